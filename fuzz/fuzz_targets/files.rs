//! Any text as a bench file, a file of several modules, and a module's configuration.

#![no_main]

use gradus_host::Config;
use gradus_sim::{BenchFile, Eeprom, RigFile, console};

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let text = String::from_utf8_lossy(data);
    if let Ok(file) = BenchFile::parse(&text) {
        let memory = Eeprom::of(file.module);
        let mut bench = file.build(memory);
        bench.run_for(5_000);
        let shown = console::execute("show", &mut bench).unwrap_or_default();
        assert!(!shown.contains("NaN") && !shown.contains("inf"), "{shown}");
    }
    if let Ok(Some(file)) = RigFile::parse(&text) {
        file.endpoints();
    }
    if let Ok(config) = Config::parse(&text, "fuzz.toml") {
        let again = Config::parse(&config.to_toml(), "again.toml").unwrap();
        assert_eq!(again.to_toml(), config.to_toml());
        config.to_program();
    }
});
