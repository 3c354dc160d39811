//! Text that goes with a program: its listing and its symbol file.

use std::fmt::Write;

use crate::assembler::Assembly;
use crate::binary;
use crate::source::Source;

/// The source texts with address and bytes in front of every command. Built-in files are left out.
pub fn listing(assembly: &Assembly) -> String {
    let mut text = String::new();
    let sources = || assembly.sources.iter().enumerate().filter(|(_, source)| !source.built_in);
    for (index, source) in sources() {
        if sources().count() > 1 {
            let _ = writeln!(text, "{:33}// {}", "", source.path.display()); // a string takes everything
        }
        listed(assembly, index, source, &mut text);
    }
    let appended = assembly.commands.len()..assembly.program.len();
    for address in appended {
        row(&mut text, assembly, Some(address), "STOP // appended");
    }
    text
}

fn listed(assembly: &Assembly, index: usize, source: &Source, text: &mut String) {
    let lines = assembly.commands.iter().map(|command| command.line);
    let mut commands = lines.enumerate().filter(|(_, span)| span.source == index).peekable();
    let mut start = 0;
    for line in source.text.split_inclusive('\n') {
        let address = commands.next_if(|(_, span)| span.start == start).map(|(address, _)| address);
        row(text, assembly, address, line.trim_end());
        start += line.len();
    }
}

fn row(text: &mut String, assembly: &Assembly, address: Option<usize>, line: &str) {
    let command = address.and_then(|address| Some((address, assembly.program.get(address)?)));
    let head = match command {
        Some((address, instruction)) => {
            let bytes = binary::bytes(instruction).map(|byte| format!("{byte:02X}")).join(" ");
            format!("{address:5}  {bytes}")
        }
        None => String::new(),
    };
    let _ = writeln!(text, "{}", format!("{head:33}{line}").trim_end());
}

/// The labels, one `label address` a line.
pub fn symbols(assembly: &Assembly) -> String {
    assembly.labels.iter().map(|label| format!("{} {}\n", label.name, label.address)).collect()
}
