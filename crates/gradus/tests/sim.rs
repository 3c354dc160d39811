//! `gradus sim` with real hosts on its endpoints.

#![cfg(unix)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use gradus_host::Session;
use gradus_tmcl::catalogue::{Ap, Gp};
use gradus_tmcl::{Instruction, Opcode};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;

const GRADUS: &str = env!("CARGO_BIN_EXE_gradus");

/// A simulator; killed if a test forgets to stop it.
struct Sim {
    process: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    /// What it printed up to `ready`.
    endpoints: Vec<String>,
}

impl Sim {
    fn start(arguments: &[&str]) -> Self {
        Self::spawn(Command::new(GRADUS).arg("sim").args(arguments))
    }

    fn spawn(command: &mut Command) -> Self {
        let command = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut process = command.spawn().unwrap();
        let input = process.stdin.take().unwrap();
        let output = BufReader::new(process.stdout.take().unwrap());
        let mut sim = Self { process, input, output, endpoints: Vec::new() };
        sim.endpoints = sim.output.by_ref().lines().map(Result::unwrap).take_while(|line| line != "ready").collect();
        sim
    }

    fn session(&self, index: usize) -> Session {
        Session::open(&self.url(index).parse().unwrap()).unwrap()
    }

    fn url(&self, index: usize) -> String {
        let endpoint = &self.endpoints[index];
        endpoint
            .strip_prefix("pty ")
            .map_or_else(|| endpoint.replacen("tcp ", "tcp:", 1), |path| format!("serial:{path}"))
    }

    fn stop(mut self) {
        kill(&self.process, "TERM");
        assert!(self.process.wait().unwrap().success());
    }
}

impl Drop for Sim {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn read_line(output: &mut impl BufRead) -> String {
    let mut line = String::new();
    output.read_line(&mut line).unwrap();
    line.trim_end().into()
}

fn kill(process: &Child, signal: &str) {
    let killed = Command::new("kill").args([&format!("-{signal}"), &process.id().to_string()]).status().unwrap();
    assert!(killed.success());
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn both_endpoints_lead_to_one_module_and_its_memory_survives() {
    let folder = tempfile::tempdir().unwrap();
    let (link, memory) = (folder.path().join("tmcm"), folder.path().join("tmcm.eeprom"));
    let arguments = ["--pty", text(&link), "--tcp", "127.0.0.1:0", "--eeprom", text(&memory)];

    let sim = Sim::start(&arguments);
    assert!(sim.endpoints[1].starts_with("tcp 127.0.0.1:") && !sim.endpoints[1].ends_with(":0"), "{:?}", sim.endpoints);
    sim.session(0).set_global(Gp::AutoStart, 0, 1).unwrap();
    let mut by_link = Session::open(&text(&link).parse().unwrap()).unwrap();
    by_link.set_axis(Ap::MaxSpeed, 1, 12_345).unwrap();
    assert_eq!(sim.session(1).get_axis(Ap::MaxSpeed, 1).unwrap(), 12_345);
    sim.stop();
    assert!(!link.exists(), "the link is removed");

    let sim = Sim::start(&arguments);
    assert_eq!(sim.session(1).get_global(Gp::AutoStart, 0).unwrap(), 1);
    sim.stop();
}

/// Programs that are started from here on begin with these signals as a terminal gives them. What the tests themselves were
/// started under ignores some, as nohup does and a shell in the background, and a program inherits that; a signal with a handler
/// it does not.
fn signals_as_in_a_terminal() {
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        flag::register(signal, Arc::default()).unwrap();
    }
    for signal in [SIGINT, SIGTERM] {
        flag::register_conditional_default(signal, Arc::new(AtomicBool::new(true))).unwrap();
    }
}

#[test]
fn each_signal_ends_it_cleanly_and_removes_the_link() {
    signals_as_in_a_terminal();
    for signal in ["INT", "TERM", "HUP"] {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("tmcm");
        let mut sim = Sim::start(&["--pty", text(&link)]);
        assert!(link.exists(), "{signal}");
        kill(&sim.process, signal);
        assert!(sim.process.wait().unwrap().success(), "{signal}");
        assert!(link.symlink_metadata().is_err(), "{signal}: the link is removed");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn under_nohup_it_outlives_its_terminal() {
    let script = r#"trap "" HUP; exec "$0" sim --tcp 127.0.0.1:0"#;
    let mut sim = Sim::spawn(Command::new("sh").args(["-c", script, GRADUS]));
    kill(&sim.process, "HUP");
    writeln!(sim.input, "show").unwrap();
    assert!(!read_line(&mut sim.output).is_empty());
    assert_eq!(sim.session(0).get_axis(Ap::TargetSpeed, 0).unwrap(), 0);
    sim.stop();
}

/// Processor time that a process has taken so far.
#[cfg(target_os = "linux")]
fn processor_seconds(process: &Child) -> f64 {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", process.id())).unwrap();
    let fields: Vec<&str> = stat.rsplit(") ").next().unwrap().split(' ').collect();
    (fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap()) / 100.0
}

#[test]
#[cfg(target_os = "linux")]
fn at_the_limit_of_descriptors_hosts_are_turned_away_and_it_does_not_spin() {
    let script = r#"ulimit -n 24; exec "$0" sim --tcp 127.0.0.1:0"#;
    let mut sim = Sim::spawn(Command::new("sh").args(["-c", script, GRADUS]));
    let address = sim.endpoints[0].strip_prefix("tcp ").unwrap().to_owned();
    let mut first = sim.session(0);
    let mut hosts: Vec<TcpStream> = (0..40).map(|_| TcpStream::connect(&address).unwrap()).collect();
    hosts[39].set_read_timeout(Some(Duration::from_secs(10))).unwrap();
    assert!(matches!(hosts[39].read(&mut [0]), Ok(0) | Err(_)), "the last one is turned away");
    let before = processor_seconds(&sim.process);
    std::thread::sleep(Duration::from_millis(500));
    assert!(processor_seconds(&sim.process) - before < 0.2, "it spins");
    assert_eq!(first.get_axis(Ap::TargetSpeed, 0).unwrap(), 0, "who is there is served");
    hosts.clear();
    let start = Instant::now();
    while Session::open(&sim.url(0).parse().unwrap()).is_err() {
        assert!(start.elapsed() < Duration::from_secs(10), "there is room again");
    }
    kill(&sim.process, "TERM");
    let mut said = String::new();
    sim.process.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert!(said.contains("\nthere is no room for more hosts; they are turned away until one leaves\n"), "{said}");
}

#[test]
#[cfg(target_os = "linux")]
fn an_input_that_is_no_operator_closes_the_console_and_not_the_simulator() {
    for (input, why) in [
        ("</dev/zero", "the console is closed: a line of more than 4096 bytes"),
        ("</dev/urandom", "the console is closed: 100 wrong lines one after another"),
    ] {
        let script = format!(r#"exec "$0" sim --tcp 127.0.0.1:0 {input}"#);
        let mut sim = Sim::spawn(Command::new("sh").args(["-c", &script, GRADUS]));
        assert_eq!(sim.session(0).get_axis(Ap::TargetSpeed, 0).unwrap(), 0, "{input}");
        kill(&sim.process, "TERM");
        let mut said = Vec::new();
        sim.process.stderr.take().unwrap().read_to_end(&mut said).unwrap();
        assert!(String::from_utf8_lossy(&said).trim_end().ends_with(why), "{input}");
        assert!(said.len() < 50_000, "{} bytes", said.len());
    }
}

#[test]
fn console_lines_change_the_machine() {
    let mut sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let mut session = sim.session(0);
    assert_eq!(session.get_axis(Ap::LeftSwitch, 0).unwrap(), 0);
    writeln!(sim.input, "switch 0 left 1\nshow").unwrap();
    read_line(&mut sim.output); // the answer to `show`: the line before has been executed
    assert_eq!(session.get_axis(Ap::LeftSwitch, 0).unwrap(), 1);
    sim.stop();
}

#[test]
fn a_bench_file_gives_the_module_a_machine_and_a_future() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("bench.toml");
    let bench = "module = 'tmcm-3351'\naxis.1 = { start = -1, travel.left.at = 0 }\nio.inputs.3 = true\n\
                 [[event]]\nat = 0.2\ndo = 'in 3 0'\n";
    std::fs::write(&file, bench).unwrap();
    let sim = Sim::start(&["--bench", text(&file), "--tcp", "127.0.0.1:0"]);
    let mut session = sim.session(0);
    assert_eq!([0, 1].map(|axis| session.get_axis(Ap::LeftSwitch, axis).unwrap()), [0, 1]);
    let start = Instant::now();
    while session.command(Instruction::new(Opcode::GIO, 3, 0, 0)).unwrap() == 1 {
        assert!(start.elapsed() < Duration::from_secs(10), "the event never happened");
    }
    sim.stop();
}

#[test]
fn a_program_runs_over_tcp_until_ctrl_c_stops_it() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let program = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cmd/run.in/forever.tmc");
    let mut command = Command::new(GRADUS);
    command.args(["run", program, "--port", &sim.url(0), "--every", "100ms"]);
    let mut run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(run.stdout.take().unwrap()).lines().map(Result::unwrap);
    assert!(lines.next().unwrap().contains("position 0"));
    assert!(lines.any(|line| line.split_whitespace().nth(2).is_some_and(|speed| speed != "0")), "the axis moves");
    kill(&run, "INT");
    lines.for_each(drop);
    assert_eq!(run.wait().unwrap().code(), Some(130));

    let mut session = sim.session(0);
    assert_eq!(session.get_global(Gp::ApplicationStatus, 0).unwrap(), 0);
    assert_eq!(session.get_axis(Ap::TargetSpeed, 0).unwrap(), 0);
    sim.stop();
}

#[test]
fn signals_of_a_module_elsewhere_are_recorded_and_those_of_its_machine_are_not_known() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("once.csv");
    let program = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cmd/run.in/once.tmc");
    let run = |arguments: &[&str]| {
        Command::new(GRADUS).args(["run", program, "--port", &sim.url(0)]).args(arguments).output().unwrap()
    };

    assert!(run(&["--signals", "deviation,max_speed", "--axes", "0", "--plot", text(&table)]).status.success());
    let table = std::fs::read_to_string(table).unwrap();
    assert_eq!(table.lines().next(), Some("time [s],axis 0 deviation [usteps],axis 0 maximum_positioning_speed [pps]"));
    let speeds: Vec<&str> = table.lines().skip(1).map(|line| line.rsplit(',').next().unwrap()).collect();
    assert!(speeds.len() > 10 && speeds.iter().all(|speed| *speed == "51200"), "{speeds:?}");

    let refused = run(&["--signals", "shaft"]);
    let message = String::from_utf8(refused.stderr).unwrap();
    assert!(message.contains("only a simulated machine knows `shaft`, not tcp:127.0.0.1:"), "{message}");
    assert_eq!(refused.status.code(), Some(1));
    sim.stop();
}

#[test]
fn a_run_that_nobody_watches_any_more_stops_program_and_motors() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let program = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cmd/run.in/forever.tmc");
    let mut command = Command::new(GRADUS);
    command.args(["run", program, "--port", &sim.url(0), "--every", "100ms"]);
    let mut run = command.stdout(Stdio::piped()).spawn().unwrap();
    let mut output = BufReader::new(run.stdout.take().unwrap());
    assert!(read_line(&mut output).contains("position 0"));
    drop(output);
    assert!(run.wait().unwrap().success(), "a closed pipe is no error");

    let mut session = sim.session(0);
    assert_eq!(session.get_global(Gp::ApplicationStatus, 0).unwrap(), 0);
    assert_eq!(session.get_axis(Ap::TargetSpeed, 0).unwrap(), 0);
    sim.stop();
}

#[test]
fn regression_messages_that_nobody_reads_are_no_panic() {
    let program = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cmd/run.in/wrong.tmc");
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let status = Command::new(GRADUS).args(["asm", program]).stderr(writer).status().unwrap();
    assert_eq!(status.code(), Some(1));
}

#[test]
fn traffic_is_recorded_and_can_be_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("sim.pcapng");
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--trace", text(&file)]);
    sim.session(0).set_axis(Ap::MaxSpeed, 1, 12_345).unwrap();
    sim.stop();
    let trace = Command::new(GRADUS).args(["trace", text(&file)]).output().unwrap();
    let shown = String::from_utf8(trace.stdout).unwrap();
    assert!(shown.contains("> 1   SAP 4, 1, 12345"), "{shown}");
    assert!(shown.contains("maximum_positioning_speed of axis 1 = 12345 pps"), "{shown}");
    let replay = Command::new(GRADUS).args(["replay", text(&file)]).output().unwrap();
    let told = String::from_utf8(replay.stdout).unwrap();
    assert!(told.ends_with("requests, all answers as recorded\n"), "{told}");
}

#[test]
fn the_trace_says_why_a_reference_search_has_found_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("sim.pcapng");
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--trace", text(&file)]);
    for command in ["SAP 193, 0, 1", "SAP 194, 0, 0", "RFS START, 0"] {
        let (status, _, message) = gradus(&["cmd", "--port", &sim.url(0), command]);
        assert_eq!(status, Some(0), "{message}");
    }
    std::thread::sleep(std::time::Duration::from_millis(200));
    sim.stop();
    let (_, shown, message) = gradus(&["trace", text(&file)]);
    let notice = "  !     the reference search of axis 0 has found no zero: the search speed is 0\n";
    assert!(shown.contains(notice), "{shown}{message}");
}

#[test]
fn a_broker_serves_several_commands_at_once() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let serve = ["serve", "--port", &sim.url(0), "--tcp", "127.0.0.1:0", "--read-only"];
    let broker = Sim::spawn(Command::new(GRADUS).args(serve));
    let (mut one, mut other) = (broker.session(0), broker.session(0));
    assert_eq!(one.get_axis(Ap::MaxSpeed, 0).unwrap(), 51_200);
    assert_eq!(other.get_axis(Ap::MaxSpeed, 0).unwrap(), 51_200);
    let set = Command::new(GRADUS).args(["set", "--port", &broker.url(0), "maximum_current", "1"]).output().unwrap();
    let message = String::from_utf8(set.stderr).unwrap();
    assert!(message.contains("was refused: command not available"), "{message}");
    let (status, _, message) = gradus(&["stop", "--port", &broker.url(0)]);
    assert!(status == Some(1) && message.contains("is for reading only"), "{message}");
    let remote = Command::new(GRADUS).args(["serve", "--port", &sim.url(0), "--tcp", "0.0.0.0:0"]).output().unwrap();
    assert!(String::from_utf8(remote.stderr).unwrap().contains("--allow-remote is needed"));
    drop((one, other));
    broker.stop();
}

fn gradus(arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(GRADUS).args(arguments).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn a_stop_lasts_on_a_served_line_until_it_is_released() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let broker = Sim::spawn(Command::new(GRADUS).args(["serve", "--port", &sim.url(0), "--tcp", "127.0.0.1:0"]));
    let url = broker.url(0);
    let mut client = broker.session(0);
    client.set_axis(Ap::TargetSpeed, 1, 20_000).unwrap();
    let (status, told, _) = gradus(&["stop", "--port", &url]);
    assert_eq!((status, client.get_axis(Ap::TargetSpeed, 1).unwrap()), (Some(0), 0));
    assert_eq!(
        told,
        format!(
            "stopped: the program and all motors of {url}\n\
             nothing that acts passes until `gradus stop --release --port {url}`\n"
        )
    );
    assert_eq!(gradus(&["stop", "--state", "--port", &url]).1, "stopped\n");
    let (status, _, complaint) = gradus(&["cmd", "--port", &url, "MVP ABS, 0, 1000"]);
    assert_eq!(status, Some(1), "{complaint}");
    let refused = client.set_axis(Ap::TargetSpeed, 1, 20_000).unwrap_err().to_string();
    assert!(
        refused
            .ends_with("is stopped: nothing that acts goes out until the stop is released (`gradus stop --release`)"),
        "{refused}"
    );
    assert_eq!(gradus(&["stop", "--release", "--port", &url]).1, "released\n");
    client.set_axis(Ap::TargetSpeed, 1, 20_000).unwrap();
    drop(client);
    broker.stop();
}

/// A program that turns motor 1 for ever, in a file.
fn turning(folder: &tempfile::TempDir) -> String {
    let file = folder.path().join("turning.tmc");
    std::fs::write(&file, "Start: ROR 1, 20000\nWAIT TICKS, 0, 10\nJA Start\n").unwrap();
    text(&file).into()
}

#[test]
fn a_program_is_loaded_started_watched_and_stopped_by_commands_of_their_own() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let (url, folder) = (sim.url(0), tempfile::tempdir().unwrap());
    let file = turning(&folder);
    let (status, told, complaint) = gradus(&["load", &file, "--port", &url]);
    assert_eq!(status, Some(0), "{complaint}");
    assert!(
        told.starts_with(&format!("{file}: 4 commands, "))
            && told.ends_with(&format!(", written to {url} and compared\n")),
        "{told}"
    );
    let shown = gradus(&["status", "--port", &url]).1;
    assert!(shown.starts_with(&format!("TMCM-3351 at {url}\nprogram: stopped, address 0\n")), "{shown}");

    assert_eq!(gradus(&["start", "--port", &url]).1, "the program runs, from address 0\n");
    let (status, lines, complaint) =
        gradus(&["watch", "--port", &url, "--for", "2500ms", "--every", "500ms", "--axes", "1"]);
    assert_eq!(status, Some(0), "{complaint}");
    assert!(lines.lines().count() >= 4 && lines.lines().last().unwrap().ends_with("20000"), "{lines}");
    let json: serde_json::Value = serde_json::from_str(&gradus(&["status", "--port", &url, "--json"]).1).unwrap();
    assert_eq!((&json["program"], &json["axes"][1]["speed"]), (&"running".into(), &20_000.into()), "{json}");

    assert_eq!(gradus(&["stop", "--port", &url]).0, Some(0));
    let shown = gradus(&["status", "--port", &url]).1;
    assert!(shown.contains("program: stopped"), "{shown}");
    let source = gradus(&["disasm", "--port", &url]).1;
    assert!(source.contains("ROR 1, 20000") && source.contains("JA "), "{source}");
    sim.stop();
}

/// A program in a file of this folder.
fn program(folder: &tempfile::TempDir, name: &str, source: &str) -> String {
    let file = folder.path().join(name);
    std::fs::write(&file, source).unwrap();
    text(&file).into()
}

#[test]
fn a_program_that_differs_from_the_one_in_a_module_is_told_by_its_lines() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let (url, folder) = (sim.url(0), tempfile::tempdir().unwrap());
    let in_module = program(
        &folder,
        "in-module.tmc",
        "Speed = 20000\nLoop: ROR 1, Speed\nWAIT TICKS, 0, 10\nCOMP 5\nJA Loop\nSTOP\n",
    );
    let (status, _, complaint) = gradus(&["load", &in_module, "--start", "--port", &url]);
    assert_eq!(status, Some(0), "{complaint}");
    let commands = |speed| format!("Loop: ROR 1, {speed}\nWAIT TICKS, 0, 10\nCOMP 5\nJA Loop\n");
    for (source, difference, verdict) in [
        (commands("20000") + "STOP\n", "the same program, 5 commands", ""),
        (
            "Speed = 30000\n".to_owned() + &commands("Speed") + "STOP\n",
            "home.tmc:2: ROR 1, Speed | ROR 1, 20000",
            "1 command differs, in values only",
        ),
        (commands("1") + "STOP\n", "home.tmc:1: ROR 1, 1 | ROR 1, 20000", "1 command differs, in values only"),
        (
            commands("20000").replace("10\nCOMP 5", "20\nCOMP 6") + "STOP\n",
            "home.tmc:3: COMP 6 | COMP 5",
            "2 commands differ, in values only",
        ),
        (
            commands("20000").replace("COMP", "MVP ABS, 0,") + "STOP\n",
            "home.tmc:3: MVP ABS, 0, 5 | COMP 5",
            "1 command differs",
        ),
        (commands("20000") + "// gradus: no-stop\n", "", "the same program, but only one of the two ends with STOP"),
    ] {
        let file = program(&folder, "home.tmc", &source);
        let (status, told, complaint) = gradus(&["verify", &file, "--port", &url]);
        assert_eq!(status, Some(i32::from(!verdict.is_empty())), "{told}{complaint}");
        assert!(told.contains(difference), "{told}");
        assert_eq!(
            complaint.lines().last().unwrap_or(""),
            if verdict.is_empty() { "".into() } else { format!("error: {verdict}") }
        );
    }
    assert_eq!(sim.session(0).get_global(Gp::ApplicationStatus, 0).unwrap() & 3, 1, "it runs as before");
    sim.stop();
}

#[test]
fn a_program_further_on_in_a_module_and_one_that_is_protected_are_told() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let (url, folder) = (sim.url(0), tempfile::tempdir().unwrap());
    let loops = "Loop: ROR 1, 20000\nWAIT TICKS, 0, 10\nJA Loop\nSTOP\n";
    let further = program(&folder, "further.tmc", &format!("MST 0\nMST 1\n{loops}"));
    assert_eq!(gradus(&["load", &further, "--port", &url]).0, Some(0));
    let file = program(&folder, "home.tmc", loops);
    let (status, _, complaint) = gradus(&["verify", &file, "--port", &url]);
    assert_eq!(status, Some(1), "{complaint}");
    assert!(complaint.ends_with("error: the same program, 2 addresses further on in the module\n"), "{complaint}");

    sim.session(0).set_global(Gp::CodeProtection, 0, 1).unwrap();
    let protected = "error: the program in the TMCM-3351 is protected against reading (global parameter 81)\n";
    for arguments in [vec!["verify", &further], vec!["disasm"]] {
        let (status, told, complaint) = gradus(&[arguments.as_slice(), &["--port", &url]].concat());
        assert_eq!((status, told.as_str()), (Some(1), ""), "{complaint}");
        assert!(complaint.ends_with(protected), "{complaint}");
    }
    sim.stop();
}

/// A line to a module that says it has firmware 1.08. Returns its port.
fn with_old_firmware(module: &str) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let (port, module) = (listener.local_addr().unwrap().port(), module.to_owned());
    std::thread::spawn(move || {
        for host in listener.incoming().map(Result::unwrap) {
            let module = TcpStream::connect(&module).unwrap();
            let (mut from_host, mut to_module) = (host.try_clone().unwrap(), module.try_clone().unwrap());
            std::thread::spawn(move || std::io::copy(&mut from_host, &mut to_module));
            std::thread::spawn(move || answer_as_old_firmware(module, host));
        }
    });
    port
}

fn answer_as_old_firmware(mut module: TcpStream, mut host: TcpStream) -> std::io::Result<()> {
    let mut reply = [0; 9];
    loop {
        module.read_exact(&mut reply)?;
        if reply.ends_with(b"V111") {
            reply[6..].copy_from_slice(b"108");
        }
        host.write_all(&reply)?;
    }
}

#[test]
fn commands_that_the_firmware_of_the_module_lacks_are_told() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let (url, folder) = (sim.url(0), tempfile::tempdir().unwrap());
    let old = format!("tcp:127.0.0.1:{}", with_old_firmware(url.strip_prefix("tcp:").unwrap()));
    let file = program(&folder, "new.tmc", "CALC LOAD, 1000\nRORA 0\nMST 0\nSTOP\n");
    let warning = "warning[needs-firmware]: `RORA` needs firmware 1.11; the program is for 1.08";
    for command in ["load", "run"] {
        let (status, _, complaint) = gradus(&[command, &file, "--port", &old]);
        assert_eq!((status, complaint.lines().next()), (Some(0), Some(warning)), "{complaint}");
        assert_eq!(gradus(&[command, &file, "--port", &old, "--deny", "needs-firmware"]).0, Some(1));
        let (status, _, complaint) = gradus(&[command, &file, "--port", &url]);
        assert!(status == Some(0) && !complaint.contains("needs-firmware"), "{complaint}");
    }
    sim.stop();
}

#[test]
fn a_program_that_is_loaded_to_start_by_itself_does_so_after_a_power_cut() {
    let mut sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let (url, folder) = (sim.url(0), tempfile::tempdir().unwrap());
    let (status, told, complaint) = gradus(&["load", &turning(&folder), "--port", &url, "--autostart", "--start"]);
    assert_eq!(status, Some(0), "{complaint}");
    assert!(told.ends_with("it starts at power-up\nit runs\n"), "{told}");
    writeln!(sim.input, "power off\npower on").unwrap();
    std::thread::sleep(Duration::from_millis(500));
    let shown = gradus(&["status", "--port", &url]).1;
    assert!(shown.contains("program: running"), "{shown}");
    sim.stop();
}

#[test]
fn nothing_is_left_in_a_virtual_module_that_ends_with_the_command() {
    let folder = tempfile::tempdir().unwrap();
    for command in [vec!["load", &turning(&folder)], vec!["start"], vec!["watch"]] {
        let (status, _, complaint) = gradus(&[command.as_slice(), &["--port", "sim:tmcm-3351"]].concat());
        assert_eq!(status, Some(1), "{command:?}");
        assert!(complaint.contains("sim:tmcm-3351 ends with this command; name a port"), "{complaint}");
    }
}

#[test]
fn a_run_that_loses_its_module_says_that_motors_may_move() {
    let mut sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let (url, folder) = (sim.url(0), tempfile::tempdir().unwrap());
    let run = Command::new(GRADUS).args(["run", &turning(&folder), "--port", &url]).stderr(Stdio::piped()).spawn();
    let run = run.unwrap();
    std::thread::sleep(Duration::from_secs(2));
    sim.process.kill().unwrap();
    sim.process.wait().unwrap();
    let output = run.wait_with_output().unwrap();
    let complaint = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{complaint}");
    assert!(complaint.contains("error: program and motors may still move: "), "{complaint}");
}

#[test]
fn a_search_that_is_interrupted_says_how_far_it_was() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("tcp:{}", listener.local_addr().unwrap());
    let scan = Command::new(GRADUS).args(["scan", "--port", &url]).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_secs(1));
    kill(&scan, "INT");
    let output = scan.wait_with_output().unwrap();
    let complaint = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{complaint}");
    assert!(
        complaint.contains("interrupted in part 2 of 2, before address ") && complaint.contains(&url),
        "{complaint}"
    );
}

#[test]
fn a_stop_of_a_line_that_nobody_shares_says_that_it_ends() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let url = sim.url(0);
    let (status, told, _) = gradus(&["stop", "--port", &url]);
    assert_eq!(status, Some(0));
    assert!(
        told.contains("the stop ends with this command") && told.contains("not shared by `gradus serve`"),
        "{told}"
    );
    for flag in ["--state", "--release"] {
        let (status, _, complaint) = gradus(&["stop", flag, "--port", &url]);
        assert_eq!(status, Some(1));
        assert!(complaint.contains("is not shared by `gradus serve`"), "{complaint}");
    }
    let (status, _, complaint) = gradus(&["stop", "--port", "sim:tmcm-3351"]);
    assert_eq!((status, complaint.contains("does nothing that could be stopped")), (Some(1), true), "{complaint}");
    sim.stop();
}

#[test]
fn a_stop_that_nobody_acknowledges_says_that_motors_may_move() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("tcp:{}?timeout=100", listener.local_addr().unwrap());
    let module = std::thread::spawn(move || {
        let mut sent = Vec::new();
        listener.accept().unwrap().0.read_to_end(&mut sent).unwrap();
        sent
    });
    let (status, _, complaint) = gradus(&["stop", "--port", &url]);
    assert_eq!(status, Some(1));
    assert!(complaint.contains("motors may still move") && complaint.contains("no module answers"), "{complaint}");
    let sent = module.join().unwrap();
    let opcodes: Vec<u8> = sent.chunks(9).map(|datagram| datagram[1]).collect();
    assert!(opcodes.ends_with(&[133, 128, 3, 3, 3, 3, 3, 3]), "it was sent all the same: {opcodes:?}");
}

#[test]
fn a_broker_without_descriptors_serves_whom_it_has_and_goes_on_later() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let serve = format!("ulimit -n 16; exec {GRADUS} serve --port {} --tcp 127.0.0.1:0", sim.url(0));
    let broker = Sim::spawn(Command::new("sh").args(["-c", &serve]));
    let mut first = broker.session(0);
    let address = broker.url(0).replace("tcp:", "");
    let crowd: Vec<_> = (0..30).map(|_| std::net::TcpStream::connect(&address).unwrap()).collect();
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(first.get_axis(Ap::MaxSpeed, 0).unwrap(), 51_200);
    drop(crowd);
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(broker.session(0).get_axis(Ap::MaxSpeed, 0).unwrap(), 51_200);
    drop(first);
    broker.stop();
}

#[test]
fn sigterm_ends_a_broker_though_a_client_does_not_read() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let broker = Sim::spawn(Command::new(GRADUS).args(["serve", "--port", &sim.url(0), "--tcp", "127.0.0.1:0"]));
    let address = broker.url(0).replace("tcp:", "");
    let mut rude = std::net::TcpStream::connect(address).unwrap();
    let instruction = Instruction::new(Opcode::GAP, 1, 0, 0);
    let requests = gradus_tmcl::Request { address: 1, instruction }.emit().repeat(5000);
    let flood = std::thread::spawn(move || while rude.write_all(&requests).is_ok() {});
    std::thread::sleep(Duration::from_millis(500));
    let start = Instant::now();
    broker.stop();
    assert!(start.elapsed() < Duration::from_secs(2), "{:?}", start.elapsed());
    flood.join().unwrap();
}

/// A host of the fleet that stores one value after the other until its line breaks; the last that was acknowledged.
fn store_until_the_end(address: std::net::SocketAddr) -> i32 {
    let mut stream = std::net::TcpStream::connect(address).unwrap();
    let mut ask = |opcode: Opcode, value: i32| {
        let instruction = Instruction::new(opcode, 9, 2, value);
        let mut reply = [0; 9];
        stream.write_all(&gradus_tmcl::Request { address: 1, instruction }.emit()).ok()?;
        stream.read_exact(&mut reply).ok()?;
        gradus_tmcl::Reply::parse(&reply).ok().filter(|reply| reply.status.is_ok())
    };
    (1..).take_while(|value| ask(Opcode::SGP, *value).and_then(|_| ask(Opcode::STGP, 0)).is_some()).last().unwrap_or(0)
}

#[test]
fn sigterm_under_load_loses_no_acknowledged_value_of_a_fleet() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--count", "8", "--tcp", "127.0.0.1:0", "--eeprom", text(folder.path())];
    let mut sim = Sim::start(&arguments);
    let addresses = sim.endpoints.iter().map(|endpoint| endpoint.strip_prefix("tcp ").unwrap().parse().unwrap());
    let hosts: Vec<_> = addresses.map(|address| std::thread::spawn(move || store_until_the_end(address))).collect();
    std::thread::sleep(Duration::from_millis(300));
    kill(&sim.process, "TERM");
    assert!(sim.process.wait().unwrap().success());
    let stored: Vec<i32> = hosts.into_iter().map(|host| host.join().unwrap()).collect();
    assert!(stored.iter().all(|value| *value > 0), "{stored:?}");

    let sim = Sim::start(&arguments);
    for (index, acknowledged) in stored.into_iter().enumerate() {
        let kept = sim.session(index).command(Instruction::new(Opcode::GGP, 9, 2, 0)).unwrap();
        // The next value may have been stored without its reply having arrived.
        assert!((acknowledged..=acknowledged + 1).contains(&kept), "module {index}: {kept}, not {acknowledged}");
    }
    sim.stop();
}

#[test]
fn a_fleet_has_ports_in_a_row() {
    // Another program may take one of the ports meanwhile: then there is no fleet, and the next try has others.
    let started = (0..20).find_map(|_| {
        let first = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port().min(60_000);
        let sim = Sim::start(&["--count", "3", "--tcp", &format!("127.0.0.1:{first}")]);
        (!sim.endpoints.is_empty()).then_some((first, sim))
    });
    let (first, sim) = started.unwrap();
    let ports: Vec<String> = (first..first + 3).map(|port| format!("tcp 127.0.0.1:{port}")).collect();
    assert_eq!(sim.endpoints, ports);
    sim.stop();
}

#[test]
fn module_on_an_rs485_line_is_lost_at_its_old_rate_and_found_at_the_new_one() {
    let folder = tempfile::tempdir().unwrap();
    let line = folder.path().join("line");
    let mut sim = Sim::start(&["--rs485", "--pty", line.to_str().unwrap()]);
    let at = |rate: u32| format!("serial:{}?baud={rate}&timeout=200", line.display());
    let open = |rate: u32, address: u8| Session::open(&format!("{}&address={address}", at(rate)).parse().unwrap());
    assert!(open(9600, 3).is_err(), "another address is not answered");
    open(9600, 1).unwrap().set_global(Gp::SerialBaudRate, 0, 7).unwrap();
    sim.input.write_all(b"reset\nshow\n").unwrap();
    read_line(&mut sim.output);
    assert!(open(9600, 1).is_err());
    let port = format!("serial:{}", line.display());
    let scan = Command::new(GRADUS).args(["scan", "--port", &port, "--addresses", "1"]).output().unwrap();
    let found = String::from_utf8(scan.stdout).unwrap();
    assert!(found.contains("baud=115200") && found.contains("TMCM-3351"), "{found}");
    assert_eq!(open(115_200, 1).unwrap().get_global(Gp::SerialBaudRate, 0).unwrap(), 7);
    kill(&sim.process, "TERM");
    let mut said = String::new();
    sim.process.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert_eq!(said, "", "a segment leaves nothing out");
}

#[test]
fn module_without_a_segment_says_what_its_line_leaves_out() {
    let mut sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    kill(&sim.process, "TERM");
    let mut said = String::new();
    sim.process.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains("--rs485"), "{said}");
}
