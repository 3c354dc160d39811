//! The Wireshark dissector: its names are those of the catalogue, and tshark shows recorded files by it.
//!
//! `TRYCMD=overwrite cargo test -p gradus --test wireshark` renews the names. `-- --ignored` runs what needs tshark.

use std::fmt::Write;
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use gradus_host::normalise;
use gradus_host::trace::{Direction, Packet, PcapngWriter, Record};
use gradus_tmcl::can::Frame;
use gradus_tmcl::catalogue::{COMMANDS, Field, MODULES, Module, OperandKind};

const RULER: &str = "-- ==========";

fn dissector() -> PathBuf {
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../tools/wireshark/tmcl.lua").into()
}

/// Numbers of the commands whose type field is such an operand, as a Lua table.
fn commands_with(kind: OperandKind) -> String {
    let has = |command: &&gradus_tmcl::catalogue::Command| {
        command.operands.iter().any(|operand| operand.field == Field::Kind && operand.kind == kind)
    };
    COMMANDS.iter().filter(has).map(|command| format!("[{}] = true, ", command.opcode.0)).collect()
}

fn axis_names(module: &Module) -> String {
    let rows = module.axis_parameters.iter();
    rows.map(|row| format!("        [{}] = \"{}\",\n", row.number, normalise(row.name))).collect()
}

fn global_names(module: &Module, bank: u8) -> String {
    let rows = module.global_parameters.iter().filter(|row| row.bank == bank);
    let all = rows.flat_map(|row| {
        let name = normalise(row.name);
        let run = row.first != row.last;
        (row.first..=row.last).map(move |number| (number, if run { format!("{name}_{number}") } else { name.clone() }))
    });
    all.map(|(number, name)| format!("[{number}] = \"{name}\", ")).collect()
}

fn names() -> String {
    let mut lua = String::from("local COMMAND = {\n");
    for command in COMMANDS {
        let name = if command.mnemonic.is_empty() { command.name } else { command.mnemonic };
        writeln!(lua, "    [{}] = \"{name}\",", command.opcode.0).unwrap();
    }
    writeln!(lua, "}}\nlocal READS_AXIS = {{ {}}}", commands_with(OperandKind::AxisParameter)).unwrap();
    writeln!(lua, "local READS_GLOBAL = {{ {}}}\nlocal AXIS = {{", commands_with(OperandKind::GlobalParameter))
        .unwrap();
    for module in MODULES {
        writeln!(lua, "    [\"{}\"] = {{\n{}    }},", module.name, axis_names(module)).unwrap();
    }
    lua.push_str("}\nlocal GLOBAL = {\n");
    for module in MODULES {
        writeln!(lua, "    [\"{}\"] = {{", module.name).unwrap();
        for bank in [0, 2, 3] {
            writeln!(lua, "        [{bank}] = {{ {}}},", global_names(module, bank)).unwrap();
        }
        lua.push_str("    },\n");
    }
    lua + "}\n"
}

#[test]
fn names_are_those_of_the_catalogue() {
    let old = fs::read_to_string(dissector()).unwrap();
    let first = old.find(RULER).unwrap();
    let begin = first + old[first..].find('\n').unwrap() + 1;
    let end = begin + old[begin..].find(RULER).unwrap();
    let new = format!("{}{}{}", &old[..begin], names(), &old[end..]);
    if std::env::var("TRYCMD").is_ok_and(|value| value == "overwrite") {
        fs::write(dissector(), new).unwrap();
    } else {
        assert!(new == old, "`TRYCMD=overwrite cargo test -p gradus --test wireshark` renews the names");
    }
}

/// What tshark prints of a file, one line a packet.
fn tshark(file: &str) -> String {
    let script = format!("lua_script:{}", dissector().display());
    let arguments = ["-X", &script, "-r", file, "-T", "fields", "-e", "_ws.col.Protocol", "-e", "_ws.col.Info"];
    let output = Command::new("tshark").args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
#[ignore = "needs tshark"]
fn tshark_shows_a_recorded_serial_line() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("line.pcapng");
    let commands = ["SAP 6, 0, 200", "GAP 4, 2", "SAP 6, 0, 256", "SGP 5, 2, -7", "MVP ABS, 0, 100"];
    let gradus =
        Command::new(env!("CARGO_BIN_EXE_gradus")).arg("cmd").arg("--trace").arg(&file).args(commands).status();
    assert_eq!(gradus.unwrap().code(), Some(1), "one command is refused");
    let shown = tshark(file.to_str().unwrap());
    let lines: Vec<&str> =
        shown.lines().filter(|line| !line.contains("get information") && !line.contains("(wrong type)")).collect();
    let expected = [
        "TMCL\t> get firmware version 0, 0, 0",
        "TMCL\t< 3351V111",
        "TMCL\t> SAP 6, 0, 200  maximum_current of axis 0",
        "TMCL\t< 100 (ok) 200  maximum_current of axis 0",
        "TMCL\t> GAP 4, 2, 0  maximum_positioning_speed of axis 2",
        "TMCL\t< 100 (ok) 51200  maximum_positioning_speed of axis 2",
        "TMCL\t> SAP 6, 0, 256  maximum_current of axis 0",
        "TMCL\t< 4 (invalid value) 256  maximum_current of axis 0",
        "TMCL\t> SGP 5, 2, -7  user_variable_5",
        "TMCL\t< 100 (ok) -7  user_variable_5",
        "TMCL\t> MVP 0, 0, 100",
        "TMCL\t< 100 (ok) 100",
    ];
    assert_eq!(lines, expected);
}

#[test]
#[ignore = "needs tshark"]
fn tshark_shows_a_recorded_can_bus() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("bus.pcapng");
    let mut writer = PcapngWriter::new(fs::File::create(&file).unwrap()).unwrap();
    let frames: [(u32, &[u8]); 5] = [
        (0x80, &[1]),
        (1, &[6, 4, 2, 0, 0, 0, 0]),
        (2, &[1, 100, 6, 0, 0, 0xc8, 0]),
        (1, &[136, 0, 0, 0, 0, 0, 0, 0]),
        (2, b"3351V111"),
    ];
    for (ms, (id, data)) in (0..).zip(frames) {
        let packet = Packet::Can(Frame::new(id, false, data).unwrap());
        // Heard on a bus, nobody knows the direction.
        writer.write(&Record { at: Duration::from_millis(ms), direction: Direction::Unknown, packet }).unwrap();
    }
    let shown = tshark(file.to_str().unwrap());
    let lines: Vec<&str> = shown.lines().skip(1).collect();
    let expected = [
        "TMCL\t> GAP 4, 2, 0  maximum_positioning_speed of axis 2",
        "TMCL\t< 100 (ok) 51200  maximum_positioning_speed of axis 2",
        "TMCL\t> get firmware version 0, 0, 0",
        "TMCL\t< 3351V111",
    ];
    assert_eq!(lines, expected, "{shown}");
    assert!(!shown.lines().next().unwrap().starts_with("TMCL"), "other traffic is left alone");
}
