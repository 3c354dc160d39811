//! The dialect, rule by rule.

use std::io;
use std::path::Path;

use gradus_asm::{Assembly, BUILT_IN, Options, assemble, assemble_line, built_in, from_bin, listing, symbols, to_bin};
use gradus_tmcl::Opcode;
use gradus_tmcl::catalogue::{MODULES, Module, TMCM_351, TMCM_1617, TMCM_3351};

const KEEP: Options = Options { no_stop: true, include_dirs: Vec::new(), constants: Vec::new() };

fn with_files(text: &[u8], files: &[(&str, &str)], module: &'static Module, options: &Options) -> Assembly {
    let load = |path: &Path| {
        let file = files.iter().find(|(name, _)| Path::new(name) == path);
        file.map(|(_, text)| text.as_bytes().to_vec()).ok_or(io::ErrorKind::NotFound.into())
    };
    let assembly = assemble("dir/main.tmc", text, module, options, &load);
    assert!(assembly.problems.is_empty(), "{}: {:#?}", String::from_utf8_lossy(text), assembly.problems);
    assembly
}

fn clean(text: impl AsRef<[u8]>) -> Assembly {
    with_files(text.as_ref(), &[], &TMCM_3351, &KEEP)
}

/// Every command as opcode, type, motor and value.
fn commands(text: impl AsRef<[u8]>) -> String {
    numbers(&clean(text))
}

fn numbers(assembly: &Assembly) -> String {
    let command = |i: &gradus_tmcl::Instruction| format!("{} {} {} {}", i.opcode.0, i.kind, i.motor, i.value);
    assembly.program.iter().map(command).collect::<Vec<_>>().join("; ")
}

#[test]
fn constants_may_come_from_outside() {
    let options = Options { constants: vec!["Motor = 2".into(), "speed = 10 * Unit".into()], ..KEEP };
    let assembly = with_files(b"Unit = 100\nROR Motor, Speed", &[], &TMCM_3351, &options);
    assert_eq!(numbers(&assembly), "1 0 2 1000");
}

#[test]
fn a_line_has_a_label_a_command_and_a_comment_each_of_which_may_be_missing() {
    for (text, expected) in [
        ("", ""),
        ("\n \t\n", ""),
        ("// nothing", ""),
        ("Here:", ""),
        ("Here: // nothing", ""),
        ("STOP", "28 0 0 0"),
        ("  STOP // end", "28 0 0 0"),
        ("Here: STOP // end", "28 0 0 0"),
        ("Here : STOP", "28 0 0 0"),
        ("MST 0//stop", "3 0 0 0"),
        ("SAP 4,0,500//fast", "5 4 0 500"),
        ("CALC DIV, 8//2", "19 3 0 8"),
        ("MST 1 // ROL 0, 5 // MST 2", "3 0 1 0"),
    ] {
        assert_eq!(commands(text), expected, "{text}");
    }
}

#[test]
fn mnemonics_keywords_names_and_directives_are_case_insensitive() {
    let text =
        "#INCLUDE tmclparam.TMC\nSpeed = 7\nlOOP: mvp abs, MOTOR1, SPEED\n  Ja LoOp\n sap apmaxacceleration, 0, 5";
    assert_eq!(commands(text), "4 0 1 7; 22 0 0 0; 5 5 0 5");
}

#[test]
fn names_begin_with_a_letter_or_underscore() {
    assert_eq!(commands("_a = 1\nb_2 = 2\nGröße = 3\n COMP _a + b_2 + grösse_\ngrösse_ = GRÖßE"), "20 0 0 6");
}

#[test]
fn labels_stand_alone_in_front_of_a_command_or_several_at_one_address() {
    let text = "A:\nB: C: MST 0\nD:\n\n// here\nE:\n MST 1\nF:\n JA A\n JA B\n JA C\n JA D\n JA E\n JA F";
    assert_eq!(commands(text), "3 0 0 0; 3 0 1 0; 22 0 0 0; 22 0 0 0; 22 0 0 0; 22 0 0 1; 22 0 0 1; 22 0 0 2");
}

#[test]
fn jumps_take_labels_addresses_and_expressions() {
    let text = "MST 0\nHere: JA Here\n JA 0\n JC GE, Here + 1\n CSUB $2\n VECT 1, Here\n RST Here\n DJNZ 5, Here\n CALL LT, Here";
    assert_eq!(
        commands(text),
        "3 0 0 0; 22 0 0 1; 22 0 0 0; 21 5 0 2; 23 0 0 2; 37 1 0 1; 48 0 0 1; 49 5 0 1; 80 6 0 1"
    );
}

#[test]
fn labels_are_numbers_and_may_be_used_before_they_are_defined() {
    let text = "JA End\n SGP 3, 2, End * 10\n CALC LOAD, -End\nTwice = 2 * End\n COMP Twice\nEnd: STOP";
    assert_eq!(commands(text), "22 0 0 4; 9 3 2 40; 19 9 0 -4; 20 0 0 8; 28 0 0 0");
}

#[test]
fn constants_may_be_defined_after_use_and_from_one_another() {
    let text = "COMP Turn * 2\nTurn = Steps * Micro\nMicro = 2 ^ 8\n COMP Steps\nSteps = 200";
    assert_eq!(commands(text), "20 0 0 102400; 20 0 0 200");
    let long: String = (0..20_000).map(|i| format!("c{i} = c{} + 1\n", i + 1)).collect();
    assert_eq!(commands(format!("{long}c20000 = 5\nCOMP c0")), "20 0 0 20005");
}

#[test]
fn numbers_are_decimal_hexadecimal_or_binary() {
    for (number, value) in [
        ("0", 0),
        ("42", 42),
        ("+42", 42),
        ("-42", -42),
        ("- 10000", -10000),
        ("2.4", 2),
        ("2.5", 3),
        ("-2.5", -3),
        ("$FF", 255),
        ("-$ff", -255),
        ("0xFF", 255),
        ("0Xff", 255),
        ("%1010", 10),
        ("0b1010", 10),
        ("0B11", 3),
        ("$FFFFFFFF", -1),
        ("4294967295", -1),
        ("-2147483648", i32::MIN),
        ("2147483647", i32::MAX),
    ] {
        assert_eq!(commands(format!("COMP {number}")), format!("20 0 0 {value}"), "{number}");
    }
}

#[test]
fn expressions_stand_everywhere_and_are_rounded_where_they_are_used() {
    let text =
        "Third = 10 / 3\n SAP 2 + 2, 1 - 1, (Third + Third) * 1.5\n GIO SQRT(9), 1\n MVP 1 - 1, 2 ^ 0, RAD(180) * 1000";
    assert_eq!(commands(text), "5 4 0 10; 15 3 1 0; 4 0 1 3142");
}

#[test]
fn keywords_may_be_given_as_numbers() {
    let words = "MVP REL, 0, 5\nRFS STATUS, 1\nCALC LOAD, 3\nCALCX SWAP\nWAIT LIMSW, 0, 9\nCLE ALL\nJC ESD, 0\nCALCVV COMP, 1, 2";
    let numbers = "MVP 1, 0, 5\nRFS 2, 1\nCALC 9, 3\nCALCX 10\nWAIT 3, 0, 9\nCLE 0\nJC 12, 0\nCALCVV 11, 1, 2";
    assert_eq!(commands(words), commands(numbers));
}

#[test]
fn a_third_operand_of_the_reading_commands_may_be_zero() {
    let three = "GAP 1, 0, 0\nGGP 1, 2, 0\nGIO 1, 0, 1 - 1\nGCO 1, 255, 0";
    assert_eq!(commands(three), commands("GAP 1, 0\nGGP 1, 2\nGIO 1, 0\nGCO 1, 255"));
}

#[test]
fn files_may_be_utf_8_or_windows_1252_with_any_line_end() {
    for text in [
        &b"// Gr\xf6\xdfe\r\nMST 0//\x96 Halt\r\nMST 1"[..],
        "// Größe\r\nMST 0//– Halt\r\nMST 1".as_bytes(),
        b"\xef\xbb\xbfMST 0\nMST 1\n",
        b"MST 0\r\nMST 1\r\n\r\n",
    ] {
        assert_eq!(commands(text), "3 0 0 0; 3 0 1 0");
    }
}

#[test]
fn included_files_give_their_names_and_commands_to_the_including_one() {
    let files = [
        ("dir/speeds.inc", "Fast = 500\nStart: MST 0"),
        ("dir/sub/moves.inc", "#include \"more moves.inc\"\n MVP ABS, 0, Far"),
        ("dir/sub/more moves.inc", "Far = Base * 10"),
    ];
    let text = "#include speeds.inc//glued\n # Include \"sub/moves.inc\" // quoted\nBase = 5\n ROL 0, Fast\n JA Start";
    let assembly = with_files(text.as_bytes(), &files, &TMCM_3351, &KEEP);
    assert_eq!(numbers(&assembly), "3 0 0 0; 4 0 0 50; 2 0 0 500; 22 0 0 0");
    assert_eq!(assembly.commands.iter().map(|command| command.line.source).collect::<Vec<_>>(), [1, 2, 0, 0]);
}

#[test]
fn includes_are_searched_beside_the_file_then_along_the_path_then_built_in() {
    let options = Options { include_dirs: vec!["first".into(), "second".into()], ..KEEP };
    let text = b"#include a.inc\n#include b.inc\n#include sub\\c.inc\n#include TMCLParam.tmc\n COMP a + b + c + Motor5";
    let mut files = vec![
        ("dir/a.inc", "a = 1"),
        ("first/a.inc", "a = 100"),
        ("first/b.inc", "b = 2"),
        ("second/b.inc", "b = 200"),
        ("second/sub/c.inc", "c = 3"),
    ];
    assert_eq!(numbers(&with_files(text, &files, &TMCM_3351, &options)), "20 0 0 11");
    files.push(("second/TMCLParam.tmc", "Motor5 = 1000"));
    assert_eq!(numbers(&with_files(text, &files, &TMCM_3351, &options)), "20 0 0 1006");
}

#[test]
fn a_file_of_constants_may_be_included_twice() {
    let files = [("dir/a.inc", "#include TMCLParam.tmc\na = 1")];
    let text = b"#include a.inc\n#include TMCLParam.tmc\n#include A.inc\n";
    with_files(text, &[files[0], ("dir/A.inc", "A = 2 - 1")], &TMCM_3351, &KEEP);
}

#[test]
fn a_stop_is_appended_unless_the_last_command_is_one() {
    for (text, appended) in [
        ("", true),
        ("MST 0", true),
        ("Loop: JA Loop", true),
        ("STOP\nMST 0", true),
        ("STOP", false),
        ("stop // end\n\n// end of the file", false),
        ("JA End\nSTOP\nEnd:", true), // the label needs a command
    ] {
        let assembly = with_files(text.as_bytes(), &[], &TMCM_3351, &Options::default());
        assert_eq!(assembly.program.len() - assembly.commands.len(), usize::from(appended), "{text}");
        assert_eq!(assembly.program.last().unwrap().opcode, Opcode::STOP, "{text}");
    }
}

#[test]
fn user_functions_take_up_to_three_numbers() {
    assert_eq!(commands("UF0\nUF7 1, 2, -3\nUF1 9"), "64 0 0 0; 71 1 2 -3; 65 9 0 0");
}

#[test]
fn data_is_a_command_in_plain_numbers() {
    assert_eq!(commands("#data 0, 0, 0, 0\n#DATA 136, 1, 2, -3"), "0 0 0 0; 136 1 2 -3");
    assert_eq!(
        commands("Here: data 0, 0, 0, Here\n DATA 136, 1, 2, -3\n # data 1, 2, 3, 4"),
        "0 0 0 0; 136 1 2 -3; 1 2 3 4"
    );
}

#[test]
fn motors_may_be_a_mask_in_coordinated_moves() {
    assert_eq!(commands("MVP COORD, $47, 2\nMVP COORD, $83, 0\nMVPA COORD, $45"), "4 2 71 2; 4 2 131 0; 46 2 69 0");
    assert_eq!(commands("SCO 0, 255, 0\nGCO 20, 255\nWAIT TICKS, 7, 50"), "30 0 255 0; 31 20 255 0; 27 0 7 50");
}

#[test]
fn a_binary_has_eight_bytes_a_command_and_no_header() {
    let program = clean("ROR 2, 350\nMVP REL, 0, -1000").program;
    let bytes = [[1, 0, 2, 0, 0, 1, 0x5e, 0x62], [4, 1, 0, 0xff, 0xff, 0xfc, 0x18, 0x17]].concat();
    assert_eq!(to_bin(&program), bytes);
    assert_eq!(from_bin(&bytes), Ok(program));
}

#[test]
fn the_listing_has_address_bytes_and_source_line() {
    let files = [("dir/more.inc", "Two = 2\r\nLast: MST Two")];
    let text = "// a program\r\n#include Interrupts.inc\nLoop: MST 0//stop\n\n#include more.inc\n JA Loop";
    let assembly = with_files(text.as_bytes(), &files, &TMCM_3351, &Options::default());
    insta::assert_snapshot!(listing(&assembly), @"
                                 // dir/main.tmc
                                 // a program
                                 #include Interrupts.inc
    0  03 00 00 00 00 00 00 03   Loop: MST 0//stop

                                 #include more.inc
    2  16 00 00 00 00 00 00 16    JA Loop
                                 // dir/more.inc
                                 Two = 2
    1  03 00 02 00 00 00 00 05   Last: MST Two
    3  1C 00 00 00 00 00 00 1C   STOP // appended
    ");
    assert_eq!(symbols(&assembly), "Loop 0\nLast 1\n");
}

#[test]
fn built_in_files_have_the_numbers_of_the_module() {
    for (module, speed, interrupts) in [(&TMCM_3351, 4, 27), (&TMCM_351, 4, 27), (&TMCM_1617, 43, 0)] {
        let text = b"#include TMCLParam.tmc\nSAP APMaxPositioningSpeed, Motor0, 1000";
        assert_eq!(numbers(&with_files(text, &[], module, &KEEP)), format!("5 {speed} 0 1000"));
        assert_eq!(built_in("interrupts.inc", module).unwrap().matches('=').count(), interrupts, "{}", module.name);
    }
    let text = "#include TMCLParam.tmc\nSGP GPSerialBaudRate, 0, 7\nGGP GPTickTimer, 0\nSGP GPUserVariable42, 2, 1\nSGP GPTimer1Period, 3, 5";
    assert_eq!(commands(text), "9 65 0 7; 10 132 0 0; 9 42 2 1; 9 1 3 5");
    assert_eq!(commands("#include Interrupts.inc\nEI TI_TIMER0\nDI TI_GLOBAL"), "25 0 0 0; 26 255 0 0");
}

/// BEHAVIOUR 8 prints these names with their numbers, which are those of the TMCM-351.
#[test]
fn programs_for_the_tmcm_351_find_the_names_they_use() {
    #[rustfmt::skip]
    let names = [
        ("Motor0", 0), ("Motor5", 5), ("APNextPosition", 0), ("APActualPosition", 1), ("APNextVelocity", 2),
        ("APActualVelocity", 3), ("APMaxPositioningSpeed", 4), ("APMaxAcceleration", 5), ("APMaxCurrent", 6),
        ("APStandbyCurrent", 7), ("APTargetPosReached", 8), ("APRefSwitchStatus", 9), ("APRightLimitSwitchStatus", 10),
        ("APLeftLimitSwitchStatus", 11), ("APRightLimitSwitchDisable", 12), ("APLeftLimitSwitchDisable", 13),
        ("APActualAcceleration", 135), ("APRampMode", 138), ("APMicrostepResolution", 140), ("APRefSwitchTolerance", 141),
        ("APSoftStopFlag", 149), ("APRampDivisor", 153), ("APPulseDivisor", 154), ("APRefSearchMode", 193),
        ("APRefSearchSpeed", 194), ("APRefSwitchSpeed", 195), ("APMixedDecay", 203), ("APFreeWheeling", 204),
        ("APStallguardThresholdLevel", 205), ("APActualStallguardValue", 206), ("APDriverErrorFlags", 208),
        ("APEncoderPosition", 209), ("APEncoderPredivAndFlags", 210), ("APFullStepThreshold", 211),
        ("APMaxEncoderDeviation", 212), ("APGroupIndex", 213), ("APVRefSearchOneSwitch", 1), ("APVRefSearchTwoSwitches", 2),
        ("APVMixedDecayPermanent", -1), ("APVMixedDecayOff", 2048), ("APVRampModePosition", 0), ("APVRampModeVelocity", 2),
        ("APVEncoderAddOnCCW", 1), ("APVEncoderAlwaysTriggerNull", 2), ("APVEncoderClearEncoderOnNull", 4),
        ("APVEncoderHoldValueOnNull", 8), ("APVEncoderNullActiveHigh", 16), ("TI_TIMER0", 0), ("TI_GLOBAL", 255),
    ];
    let assembly = with_files(b"#include TMCLParam.tmc\n#include Interrupts.inc", &[], &TMCM_351, &KEEP);
    for (name, value) in names {
        let constant = assembly.constants.iter().find(|constant| constant.name == name);
        assert_eq!(constant.map(|constant| constant.value), Some(f64::from(value)), "{name}");
    }
}

#[test]
fn every_built_in_file_assembles_and_names_every_parameter_and_interrupt() {
    for module in MODULES {
        for file in BUILT_IN {
            let assembly = with_files(format!("#include {file}").as_bytes(), &[], module, &KEEP);
            let globals =
                module.global_parameters.iter().map(|row| usize::from(row.last - row.first) + 1).sum::<usize>();
            let parameters = module.axis_parameters.len() + globals + 17;
            let rows = if file == BUILT_IN[0] { parameters } else { module.interrupts.len() };
            assert_eq!(assembly.constants.len(), rows, "{file} for the {}", module.name);
        }
    }
}

#[test]
fn one_command_is_assembled_for_direct_mode_with_the_names_of_the_built_in_files() {
    for (text, bytes) in [
        ("GAP 1, 0", [6, 1, 0, 0, 0, 0, 0]),
        (" sap APMaxCurrent, Motor1, 2 * 50 // percent", [5, 6, 1, 0, 0, 0, 100]),
        ("EI TI_GLOBAL", [25, 255, 0, 0, 0, 0, 0]),
        ("#data 136, 1, 0, 0", [136, 1, 0, 0, 0, 0, 0]),
        // What the module will refuse is for the module to say.
        ("GAP 250, 9", [6, 250, 9, 0, 0, 0, 0]),
        ("STAP 4, 0", [7, 4, 0, 0, 0, 0, 0]),
        ("JA 5", [22, 0, 0, 0, 0, 0, 5]),
    ] {
        assert_eq!(assemble_line(text, &TMCM_3351).map(|i| i.to_bytes()), Ok(bytes), "{text}");
    }
}
