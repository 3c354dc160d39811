//! Assembler and disassembler for TMCL, with problems as data.
//!
//! [`assemble`] always gives a program and a list of problems; it never stops at the first. It reads no file itself: what
//! a program includes comes through a function, so that tests and editors work in memory.
//!
//! ```
//! use gradus_asm::{Options, assemble, to_bin};
//! use gradus_tmcl::catalogue::TMCM_3351;
//!
//! let text = b"Loop: MVP ABS, 0, 51200\n WAIT POS, 0, 0\n JA Loop";
//! let assembly = assemble("loop.tmc", text, &TMCM_3351, &Options::default(), &|path| std::fs::read(path));
//! assert!(assembly.problems.is_empty());
//! assert_eq!(to_bin(&assembly.program)[..8], [0x04, 0, 0, 0, 0, 0xc8, 0, 0xcc]);
//! ```
//!
//! # The dialect
//!
//! ```text
//! [label:] [MNEMONIC operand, operand, ...] [// comment]
//! NAME = expression
//! #include file            // or "file"; beside this file, along the include path, or built in
//! #data opcode, type, motor, value
//! ```
//!
//! Case does not matter. Files are UTF-8 or Windows-1252; UTF-16 and bytes that are no text are refused. Labels and constants are one set of names over all files of a
//! program and may be used before they are defined; a label is also a number. Numbers are `42`, `2.5`, `$2A`, `0x2A`,
//! `%101010` and `0b101010`. Expressions stand wherever a number does: `+ - * / ^ ( )` and the functions SIN COS TAN ASIN
//! ACOS ATAN LOG LN EXP SQRT ABS INT ROUND SIGN DEG RAD. They are calculated in floating point and rounded, half away from
//! zero, where a command uses them.
//!
//! Where the maker's manuals are silent:
//! - `-2^2` is -4, `2^3^2` is 512, LOG is the decimal logarithm.
//! - A constant may be defined again with the same value, so that two files may include the same third one.
//! - `TMCLParam.tmc` and `Interrupts.inc` are built in, with the names and numbers of the module's catalogue.
//! - `#data`, or `DATA` without the sign, is ours: it says what the language cannot, so that every program memory can be
//!   disassembled.
//! - A jump behind the end of the program is a warning: another program may lie there.
//!
//! Not here: ports and downloading, see `gradus-host`.

#![forbid(unsafe_code)]
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod assembler;
mod binary;
mod builtin;
mod check;
mod code;
mod comments;
mod dialects;
mod difference;
mod disassembler;
mod effects;
mod encoder;
mod expression;
mod fix;
mod flow;
mod format;
mod fuzz;
mod identity;
mod lexer;
mod lint;
mod listing;
mod loops;
mod names;
mod nearest;
mod parser;
mod pragma;
mod problem;
mod reader;
mod render;
mod source;
mod uses;
mod values;

pub use assembler::{Assembly, CommandText, Constant, Label, Options, assemble, assemble_line};
pub use binary::{BinaryError, from_bin, to_bin};
pub use builtin::{BUILT_IN, built_in};
pub use code::Code;
pub use comments::module_of;
pub use difference::Difference;
pub use disassembler::disassemble;
pub use effects::{Effects, Places};
pub use expression::functions;
pub use fix::{Changed, apply_fixes};
pub use format::{FormatError, Formatted, format};
pub use fuzz::{fuzz_check, fuzz_format, fuzz_source};
pub use identity::Identity;
pub use lint::{LintOptions, lint};
pub use listing::{listing, symbols};
pub use names::Defined;
pub use pragma::{PRAGMAS, Pragmas, firmware};
pub use problem::{Edit, Fix, Note, Problem, Severity, Span};
pub use reader::{Load, normal};
pub use render::{Style, render};
pub use source::Source;
pub use uses::Use;
