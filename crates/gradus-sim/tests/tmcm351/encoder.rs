//! The encoder: prescalers, the functions of the index, and the stop on a deviation.

use gradus_plant::Encoder;

use crate::support::Host;

/// Codes and multipliers of the table (axis parameter 210).
const PRESCALERS: [(i32, f64); 19] = [
    (64, 0.125),
    (128, 0.25),
    (256, 0.5),
    (512, 1.0),
    (800, 1.5625),
    (66_144, 1.6),
    (1024, 2.0),
    (1600, 3.125),
    (67_104, 3.2),
    (2048, 4.0),
    (3200, 6.25),
    (68_672, 6.4),
    (4096, 8.0),
    (6400, 12.5),
    (71_808, 12.8),
    (8192, 16.0),
    (78_432, 25.6),
    (16_384, 32.0),
    (32_768, 64.0),
];

fn host(counts_per_turn: u32, index: Option<u32>) -> Host {
    let mut host = Host::new();
    host.bench.machine().axes[0].plant.encoder = Some(Encoder { counts_per_turn, index, ..Encoder::default() });
    host
}

#[test]
fn every_prescaler_multiplies_the_counts() {
    for (code, factor) in PRESCALERS {
        let mut host = host(4000, None);
        host.all(&format!("SAP 210, 0, {code}; SAP 209, 0, 0; SAP 140, 0, 6; MVP ABS, 0, 12800"));
        host.arrive(0);
        assert_eq!(f64::from(host.get(209, 0)), (4000.0 * factor).round(), "code {code}");
        host.all(&format!("SAP 210, 0, {}; SAP 209, 0, 0; MVP ABS, 0, 0", code + 1));
        host.arrive(0);
        assert_eq!(f64::from(host.get(209, 0)), (4000.0 * factor).round(), "code {code}, reversed");
    }
}

#[test]
fn other_codes_are_refused() {
    let mut host = Host::new();
    for code in [63, 96, 545, 100_000] {
        assert_eq!(host.exchange(&format!("SAP 210, 0, {code}")).0, 4, "{code}");
    }
}

#[test]
fn index_does_what_the_flags_say() {
    const CODE: i32 = 512;
    // The index is at counts 1000 and 5000; the shaft goes to 6000 counts, then back to 0.
    for (flags, there, back) in [
        (0, 6000, 0),
        (16 + 4, 5000, -1000),
        (16 + 4 + 2, 1000, -1000),
        (16 + 8, 1000, 1000),
        (16 + 8 + 2, 5000, 1000),
        (16 + 8 + 4 + 2, 0, 0),
        (4, 4999, -1001),
    ] {
        let mut host = host(4000, Some(1000));
        host.all(&format!("SAP 140, 0, 6; SAP 210, 0, {}; SAP 209, 0, 0; MVP ABS, 0, 19200", CODE + flags));
        host.arrive(0);
        assert_eq!(host.get(209, 0), there, "flags {flags}");
        host.ask("MVP ABS, 0, 0");
        host.arrive(0);
        assert!((host.get(209, 0) - back).abs() <= 1, "flags {flags}: {}", host.get(209, 0));
    }
}

#[test]
fn deviation_stops_until_a_position_is_written() {
    let mut host = host(4000, None);
    host.all("SAP 140, 0, 6; SAP 210, 0, 67104; SAP 209, 0, 0; SAP 212, 0, 250; MVP ABS, 0, 12800");
    host.arrive(0);
    host.bench.machine().axes[0].plant.encoder.as_mut().unwrap().slip = 5120;
    host.ask("MVP ABS, 0, 25600");
    host.run_ms(100);
    assert_eq!((host.get(207, 0), host.get(3, 0), host.get(8, 0)), (1, 0, 0));
    let (position, encoder) = (host.get(1, 0), host.get(209, 0));
    assert!((position - encoder).abs() > 250, "{position} {encoder}");
    host.all(&format!("SAP 0, 0, {encoder}; SAP 1, 0, {encoder}; MVP ABS, 0, 25600"));
    host.arrive(0);
    assert_eq!((host.get(1, 0), host.get(207, 0)), (25_600, 0));
}
