use gradus_tmcl::catalogue::Ap;

use super::*;

const BUSES: &str = "[[bus]]\nname = 'segment'\nkind = 'rs485'\n[[bus]]\nname = 'field'\nkind = 'can'\n";

fn parsed(text: &str) -> RigFile {
    match RigFile::parse(text) {
        Ok(Some(rig)) => rig,
        Ok(None) => panic!("taken for one module"),
        Err(problem) => panic!("{problem}"),
    }
}

#[test]
fn example_of_the_module_text_is_a_rig() {
    let lines = include_str!("../rig_file.rs").lines().map_while(|line| line.strip_prefix("//!"));
    let example = lines.skip_while(|line| *line != " ```toml").skip(1).take_while(|line| *line != " ```");
    let file = parsed(&example.collect::<Vec<_>>().join("\n"));
    let endpoints: Vec<String> = file.endpoints().iter().map(|(bus, endpoint)| format!("{bus} {endpoint}")).collect();
    let expected =
        ["0 pty /tmp/segment", "0 tcp 127.0.0.1:4322", "1 slcan 127.0.0.1:0", "1 socketcand 127.0.0.1:28600"];
    assert_eq!(endpoints, expected);
    assert_eq!(file.events, [(60_000_000, 1, BusChange::Cut(true))]);
    let folder = tempfile::tempdir().unwrap();
    let mut rig = RigFile { folder: folder.path().into(), ..file }.build().unwrap();
    assert_eq!((rig.module_names(), rig.bus_names().count()), (["x".into(), "y".into()].as_slice(), 2));
    assert!(folder.path().join("x.eeprom").exists());
    assert_eq!(rig.with_bench(0, |bench| bench.axis_parameter(0, Ap::LeftSwitch)), Some(0));
}

#[test]
fn file_of_one_module_is_no_rig() {
    for text in ["module = 'tmcm-3351'", "", "[axis.0]", "[["] {
        assert!(matches!(RigFile::parse(text), Ok(None)), "{text}");
    }
}

#[test]
fn buses_work_as_the_file_says() {
    let rs485 = Serial::rs485(9600);
    let strict = Serial { strict: true, ..rs485 };
    let cases = [
        ("kind = 'usb'", BusKind::Serial(Serial::USB)),
        ("kind = 'rs485'", BusKind::Serial(strict)),
        ("kind = 'rs485'\nbaud = 'strict'", BusKind::Serial(strict)),
        ("kind = 'rs485'\nbaud = 9600", BusKind::Serial(rs485)),
        ("kind = 'rs485'\ntiming = false", BusKind::Serial(strict.without_timing())),
        ("kind = 'rs232'\nbaud = 19200", BusKind::Serial(Serial::rs232(19_200))),
        (
            "kind = 'rs485'\nbaud = 115200\nturn_around_us = 500\ngap_ms = 5\necho = true",
            BusKind::Serial(Serial { turn_around_us: Some(500), gap_us: 5000, echo: true, ..Serial::rs485(115_200) }),
        ),
        ("kind = 'can'", BusKind::Can(Can { bit_rate: 1_000_000, timing: true })),
        ("kind = 'can'\nbit_rate = 250_000\ntiming = false", BusKind::Can(Can { bit_rate: 250_000, timing: false })),
    ];
    for (keys, kind) in cases {
        assert_eq!(parsed(&format!("[[bus]]\nname = 'b'\n{keys}")).buses[0].kind(), kind, "{keys}");
    }
}

#[test]
fn problems_name_line_and_key_and_say_what_is_expected() {
    let module = |keys: &str| format!("{BUSES}[[module]]\nname = 'x'\nbus = 'field'\nmodule = 'tmcm-3351'\n{keys}");
    let cases = [
        ("[[bus]]\nname = 'b'".into(), "1: bus: missing field `kind`"),
        (
            "[[bus]]\nname = 'b'\nkind = 'lin'".into(),
            "3: bus.kind: unknown variant `lin`, expected one of `usb`, `rs232`, `rs485`, `can`",
        ),
        (
            "[[bus]]\nname = 'b'\nkind = 'can'\nbaud = 9600".into(),
            "4: bus.baud: only a bus of the kind rs232 or rs485 has this key",
        ),
        (
            "[[bus]]\nname = 'b'\nkind = 'rs485'\nbaud = 'fast'".into(),
            "4: bus.baud: expected bits a second, or \"strict\"",
        ),
        (
            format!("{BUSES}baud = 1\n").replace("'can'\nbaud = 1", "'rs485'\nbaud = 12345")
                + "[[module]]\nname = 'x'\nbus = 'field'\nmodule = 'tmcm-1617'",
            "7: bus.baud: the TMCM-1617 has no such rate, only 9600, 14400, 19200, 28800, 38400, 57600, 76800, 115200",
        ),
        (
            "[[bus]]\nname = 'b'\nkind = 'usb'\nbit_rate = 9600".into(),
            "4: bus.bit_rate: only a bus of the kind can has this key",
        ),
        (
            "[[bus]]\nname = 'b'\nkind = 'usb'\nendpoints = ['pty',\n'slcan']".into(),
            "5: bus.endpoints: a serial line has the endpoints pty and tcp",
        ),
        (
            "[[bus]]\nname = 'b'\nkind = 'can'\nendpoints = ['tcp:127.0.0.1:1']".into(),
            "4: bus.endpoints: a CAN bus has the endpoints slcan, socketcand and can",
        ),
        (
            "[[bus]]\nname = 'b'\nkind = 'can'\nfaults = 'noise'".into(),
            "4: bus.faults: there is no profile `noise`, only noisy-line, bad-usb-cable, late-replies",
        ),
        (
            "[[bus]]\nname = 'b'\nkind = 'can'\nfaults = { flipped = 2 }".into(),
            "4: bus.faults.flipped: invalid value: integer `2`, expected a share from 0 to 1",
        ),
        (
            "[[bus]]\nname = 'b'\nkind = 'can'\nfaults = { seed = 2 }".into(),
            "4: bus.faults.seed: unknown field `seed`, expected one of `flipped`",
        ),
        (
            "[[bus]]\nname = 'b'\nkind = 'can'\nfaults = 7".into(),
            "4: bus.faults: invalid type: integer `7`, expected a profile's name or a table",
        ),
        (
            "[[bus]]\nname = 'b'\nkind = 'can'\nevent = [{ at = 1, do = 'in 1 1' }]".into(),
            "4: bus.event.do: expected a line of the console that changes a bus: cut, babble or faults",
        ),
        (format!("{BUSES}[[bus]]\nname = 'field'\nkind = 'can'"), "8: bus.name: there are two of the name `field`"),
        (format!("{BUSES}[[module]]\nname = 'x'"), "7: module: missing field `bus`"),
        (format!("{BUSES}[[module]]\nname = 'x'\nbus = 'field'"), "7: module: missing field `module`"),
        (
            format!("{BUSES}[[module]]\nname = 'x'\nbus = ['field', 'usb']\nmodule = 'tmcm-3351'"),
            "9: module.bus: there is no bus `usb`, only segment, field",
        ),
        (module("address = 256"), "11: module.address: expected a whole number from 1 to 255"),
        (module("can_id = -1"), "11: module.can_id: expected a whole number from 0 to 2047"),
        (module("axis.3.start = 1"), "11: module.axis.3: expected an axis: 0, 1, 2"),
        (module("colour = 1"), "11: module.colour: unknown field `colour`, expected one of"),
        (
            "[[bus]]\nname = 'u'\nkind = 'usb'\n[[module]]\nname = 'a'\nbus = 'u'\nmodule = 'tmcm-3351'\n\
             [[module]]\nname = 'b'\nbus = 'u'\nmodule = 'tmcm-3351'"
                .into(),
            "3: bus.kind: USB is point to point and has one module; use rs485 or several buses",
        ),
    ];
    for (text, message) in cases {
        let found = RigFile::parse(&text).map(|_| ()).unwrap_err().to_string();
        assert!(found.starts_with(message), "{text}\n{found}");
    }
}

#[test]
fn modules_start_at_the_rates_of_the_file_and_else_at_their_own() {
    let text = |keys: &str| {
        format!(
            "[[bus]]\nname = 's'\nkind = 'rs485'\n{keys}\n[[bus]]\nname = 'c'\nkind = 'can'\nbit_rate = 250_000\n\
             [[module]]\nname = 'x'\nbus = ['s', 'c']\nmodule = 'tmcm-3351'"
        )
    };
    for (keys, baud) in [("baud = 115200", 115_200), ("baud = 'strict'", 9600), ("", 9600), ("timing = false", 9600)] {
        let mut rig = parsed(&text(keys)).build().unwrap();
        let rates = rig.with_bench(0, |bench| bench.line_rates());
        assert_eq!(rates, Some(crate::LineRates { baud, can: 250_000 }), "{keys}");
    }
}

#[test]
fn modules_have_the_addresses_of_the_file() {
    let text = format!(
        "{BUSES}[[module]]\nname = 'x'\nbus = 'segment'\nmodule = 'tmcm-3351'\naddress = 7\nsecondary_address = 9\n\
         can_id = 1000\ncan_reply_id = 0\ncan_secondary_id = 3\ntelegram_pause_ms = 4"
    );
    let mut rig = parsed(&text).build().unwrap();
    let firmware = |bench: &mut crate::Bench| {
        let mut link = bench.attach(gradus_firmware::LinkKind::Usb, 0);
        [66, 87, 75, 71, 70, 83].map(|number| {
            bench.send(&mut link, &[1, 10, number, 0, 0, 0, 0, 0, 11 + number]);
            bench.take(&mut link).and_then(|bytes| gradus_tmcl::Reply::parse(&bytes).ok()).map(|reply| reply.value)
        })
    };
    assert_eq!(rig.with_bench(0, firmware), [7, 9, 4, 1000, 0, 3].map(Some));
}
