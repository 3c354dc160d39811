//! Configurations: file, module and program.

use std::time::Duration;

use gradus_asm::{Options, assemble};
use gradus_host::{Config, ConfigError, Session, settings};
use gradus_tmcl::catalogue::{Ap, Gp, MODULES, TMCM_3351};

fn session() -> Session {
    Session::open(&"sim:tmcm-3351".parse().unwrap()).unwrap()
}

fn parse(text: &str) -> Config {
    Config::parse(&format!("module = 'TMCM-3351'\n{text}"), "stage.toml").unwrap()
}

fn apply(session: &mut Session, config: &Config) -> Vec<String> {
    let written = config.apply(session, |_| {}).unwrap();
    written.iter().map(|difference| difference.setting.to_string()).collect()
}

#[test]
fn a_fresh_module_has_its_defaults() {
    let mut session = session();
    let read = Config::read(&mut session, |_| {}).unwrap();
    assert_eq!(read.values, Config::defaults(&TMCM_3351).values);
}

#[test]
fn only_differences_are_written_and_each_is_read_back() {
    let mut session = session();
    let config = parse("[global]\nserial-heartbeat = 5000\n[axis.1]\nmaximum_current = 200\nstandby_current = 32");
    assert_eq!(apply(&mut session, &config), ["serial_heartbeat", "maximum_current of axis 1"]);
    assert_eq!(session.get_axis(Ap::MaxCurrent, 1).unwrap(), 200);
    assert_eq!(session.get_global(Gp::SerialHeartbeat, 0).unwrap(), 5000);
    assert!(apply(&mut session, &config).is_empty());
}

#[test]
fn units_come_first_and_what_the_module_is_reached_by_comes_last() {
    let config = parse(
        "[global]\nserial_address = 7\ncan_id = 9\nauto_start_mode = 1\n\
         [axis.0]\nclosed_loop_mode = 1\nmaximum_current = 99\nunit_mode = 0",
    );
    let expected = [
        "unit_mode of axis 0",
        "auto_start_mode",
        "maximum_current of axis 0",
        "closed_loop_mode of axis 0",
        "serial_address",
        "can_id",
    ];
    let mut session = session();
    assert_eq!(apply(&mut session, &config), expected);
    assert_eq!(session.address().module, 7, "the session goes on under the new address");
    assert!(config.differences(&mut session, |_| {}).unwrap().is_empty());
}

#[test]
fn a_file_for_another_module_is_refused_and_nothing_is_written() {
    let mut session = session();
    let config = Config::parse("module = 'TMCM-351'\n[axis.0]\nstandby_current = 99", "x.toml").unwrap();
    let error = config.apply(&mut session, |_| {}).unwrap_err();
    assert!(matches!(error, ConfigError::OtherModule { .. }), "{error}");
    let message = error.to_string();
    assert!(message.contains("for a TMCM-351, but sim:tmcm-3351 is a TMCM-3351; nothing was written"), "{message}");
    assert!(config.differences(&mut session, |_| {}).is_err());
    assert_eq!(session.get_axis(Ap::StandbyCurrent, 0).unwrap(), 32);
}

#[test]
fn giving_up_read_protection_is_refused_before_anything_is_written() {
    let mut session = session();
    session.set_global(Gp::CodeProtection, 0, 3).unwrap();
    let config = parse("[global]\nauto_start_mode = 1\ntmcl_code_protection = 2");
    let error = config.apply(&mut session, |_| {}).unwrap_err();
    assert!(matches!(error, ConfigError::ErasesProgram { .. }), "{error}");
    assert_eq!(session.get_global(Gp::AutoStart, 0).unwrap(), 0);
}

#[test]
fn mistakes_are_all_told_with_their_lines() {
    let text = "module = 'TMCM-3351'\nspeed = 1\n[global]\nserial_adress = 3\ntmcl_tick_timer = 1\nserial_address = 256\n\
                [axis.3]\nmaximum_current = 1\n[axis.0]\nstandby_current = 'high'\nactual_position = 5\nmax_current = 3\n\
                maximum_current = 3\n";
    let error = Config::parse(text, "stage.toml").unwrap_err();
    insta::assert_snapshot!(error, @r"
    stage.toml:2: expected are `module`, [global] and [axis.N]
    stage.toml:4: the TMCM-3351 has no parameter `serial_adress`; did you mean serial_address or serial_host_address or serial_secondary_address?
    stage.toml:5: tmcl_tick_timer (global parameter 132, bank 0) is no setting; `gradus config dump` shows what is
    stage.toml:6: serial_address (global parameter 66, bank 0) takes 1 to 255
    stage.toml:7: the TMCM-3351 has the axes 0 to 2
    stage.toml:10: standby_current (axis parameter 7) takes 0 to 255
    stage.toml:11: actual_position (axis parameter 1) is no setting; `gradus config dump` shows what is
    stage.toml: maximum_current of axis 0 is set twice, under two spellings
    ");
    for (text, expected) in [
        ("", "stage.toml:1: `module` is missing; it is one of TMCM-3351, TMCM-1617, TMCM-351"),
        ("module = 'TMCM-9'", "stage.toml:1: `module` is one of TMCM-3351"),
        ("\nmodule = ", "stage.toml:2: "),
    ] {
        let message = Config::parse(text, "stage.toml").unwrap_err().to_string();
        assert!(message.starts_with(expected), "{message}");
    }
}

#[test]
fn comments_of_a_file_stay_and_notes_follow_the_values() {
    let old = "# my stage\nmodule = \"TMCM-3351\"\n\n[axis.0] # the long one\n\
               # gentle\nMaximum-Current = 128 # default\nstandby_current = 32 # cold enough\n";
    let mut session = session();
    session.set_axis(Ap::MaxCurrent, 0, 200).unwrap();
    session.set_axis(Ap::StandbyCurrent, 0, 8).unwrap();
    let new = Config::read(&mut session, |_| {}).unwrap().update(old).unwrap();
    let expected = "# my stage\nmodule = \"TMCM-3351\"\n\n[axis.0] # the long one\n\
                    # gentle\nMaximum-Current = 200 # default 128\nstandby_current = 8 # cold enough\n";
    assert!(new.starts_with(expected), "{new}");
    assert_eq!(Config::parse(&new, "").unwrap().values.len(), settings(&TMCM_3351).count());
}

#[test]
fn a_program_sets_after_a_power_cut_what_the_module_has_forgotten() {
    let mut session = session();
    let config = parse(
        "[global]\ntimer_0_period = 250\nstop_left_0_trigger_transition = 3\nserial_heartbeat = 1000\n\
         [axis.0]\nmaximum_current = 200\n[axis.2]\nreference_search_mode = 65",
    );
    apply(&mut session, &config);
    let source = Config::read(&mut session, |_| {}).unwrap().to_program();
    assert_eq!(source, config.to_program());
    insta::assert_snapshot!(source, @r"
    // Initialisation of a TMCM-3351: settings that it does not keep by itself.
    #include TMCLParam.tmc

        SGP 0, 3, 250 // timer_0_period
        SGP 27, 3, 3 // stop_left_0_trigger_transition; both
        SAP APMaxCurrent, 0, 200 // maximum_current
        SAP APRefSearchMode, 2, 65 // reference_search_mode; modes 1..4 with left and right exchanged
        STOP
    ");

    let no_files = |_: &std::path::Path| Err(std::io::ErrorKind::NotFound.into());
    let assembly = assemble("init.tmc", source.as_bytes(), &TMCM_3351, &Options::default(), &no_files);
    assert!(assembly.problems.is_empty(), "{:?}", assembly.problems);
    session.download(&assembly.program, |_| {}).unwrap();
    session.set_global(Gp::AutoStart, 0, 1).unwrap();
    let bench = session.bench().unwrap();
    bench.power_off();
    bench.power_on();
    session.sleep(Duration::from_millis(100));
    assert!(config.differences(&mut session, |_| {}).unwrap().is_empty());
}

#[test]
fn every_module_has_a_program_that_assembles() {
    for module in MODULES {
        let mut config = Config::defaults(module);
        for (setting, value) in &mut config.values {
            // Another value than the default, so that every line is there.
            let other = [*value + 1, *value - 1]
                .into_iter()
                .find(|other| setting.named.encode(*other).is_some_and(|other| setting.named.accepts(other)));
            *value = other.unwrap_or(*value);
        }
        let no_files = |_: &std::path::Path| Err(std::io::ErrorKind::NotFound.into());
        let source = config.to_program();
        let assembly = assemble("init.tmc", source.as_bytes(), module, &Options::default(), &no_files);
        assert!(assembly.problems.is_empty(), "{}: {:?}", module.name, assembly.problems);
    }
}

#[test]
fn every_virtual_module_takes_its_configuration_and_stores_what_it_can() {
    for module in gradus_host::VIRTUAL_MODULES {
        let url = format!("sim:{}", module.name).parse().unwrap();
        let mut session = Session::open(&url).unwrap();
        let text = format!("module = '{}'\n[axis.0]\nmaximum_acceleration = 400\ngroup_index = 0", module.name);
        let text = text
            .replace("maximum_acceleration", if module.axes == 1 { "acceleration" } else { "maximum_acceleration" });
        let text = if module.axes == 1 { text.replace("group_index = 0", "") } else { text };
        let config = Config::parse(&text, "x.toml").unwrap();
        assert_eq!(config.apply(&mut session, |_| {}).unwrap().len(), 1, "{}", module.name);
        let stored = config.store(&mut session).unwrap();
        let bench = session.bench().unwrap();
        bench.power_off();
        bench.power_on();
        session.sleep(Duration::from_secs(1));
        let lost = config.differences(&mut session, |_| {}).unwrap().len();
        assert_eq!(stored + lost, 1, "{}: what is not stored is lost", module.name);
        assert_eq!(stored == 1, config.is_storable());
    }
}

#[test]
fn a_locked_eeprom_is_unlocked_by_the_file_or_not_at_all() {
    let mut session = Session::open(&"sim:tmcm-351".parse().unwrap()).unwrap();
    let parse = |text: &str| Config::parse(&format!("module = 'TMCM-351'\n[global]\n{text}"), "x.toml").unwrap();
    let lock = "configuration_eeprom_lock_flag";
    assert_eq!(apply(&mut session, &parse(&format!("{lock} = 1\nauto_start_mode = 1"))), ["auto_start_mode", lock]);
    let error = parse("auto_start_mode = 0").apply(&mut session, |_| {}).unwrap_err();
    assert!(matches!(error, ConfigError::Locked { .. }), "{error}");
    assert!(apply(&mut session, &parse("auto_start_mode = 1")).is_empty(), "nothing to store, nothing to refuse");
    assert_eq!(apply(&mut session, &parse(&format!("auto_start_mode = 0\n{lock} = 0"))), [lock, "auto_start_mode"]);
}

#[test]
fn internal_units_are_named_and_survive_file_and_program() {
    let mut session = session();
    apply(&mut session, &parse("[axis.1]\nunit_mode = 0\nmaximum_positioning_speed = 5000000"));
    let read = Config::read(&mut session, |_| {}).unwrap();
    let text = read.to_toml();
    assert!(text.contains("\nmaximum_positioning_speed = 5000000 # internal units\n"), "{text}");
    assert!(text.contains("\nmaximum_positioning_speed = 51200 # pps; default\n"), "{text}");
    let mut fresh = self::session();
    Config::parse(&text, "x.toml").unwrap().apply(&mut fresh, |_| {}).unwrap();
    assert_eq!(Config::read(&mut fresh, |_| {}).unwrap().values, read.values);
    let program = read.to_program();
    let (mode, speed) = (program.find("APUnitMode, 1, 0").unwrap(), program.find("APMaxPositioningSpeed, 1").unwrap());
    assert!(mode < speed, "{program}");
}
