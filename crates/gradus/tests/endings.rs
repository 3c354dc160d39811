//! What ends a command before its time, and what it leaves behind.

#![cfg(unix)]

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use gradus_host::Session;
use gradus_tmcl::catalogue::Ap;

const GRADUS: &str = env!("CARGO_BIN_EXE_gradus");
/// No command may take longer to end.
const PATIENCE: Duration = Duration::from_secs(20);

/// A virtual module on TCP; killed when it is dropped.
struct Sim {
    process: Child,
    console: ChildStdin,
    /// Kept open: without a reader it would end.
    _output: BufReader<ChildStdout>,
    url: String,
}

impl Sim {
    fn start() -> Self {
        let mut command = Command::new(GRADUS);
        let command = command.args(["sim", "--tcp", "127.0.0.1:0"]).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut process = command.spawn().unwrap();
        let console = process.stdin.take().unwrap();
        let mut output = BufReader::new(process.stdout.take().unwrap());
        let mut line = String::new();
        output.read_line(&mut line).unwrap();
        let url = line.trim().replacen("tcp ", "tcp:", 1);
        Self { process, console, _output: output, url }
    }
}

impl Drop for Sim {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A folder with a program that turns motor 0 for ever.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("turn.tmc"), "ROR 0, 10000\nLoop: WAIT TICKS, 0, 10\nJA Loop").unwrap();
    folder
}

fn gradus(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(GRADUS);
    command.current_dir(folder).args(arguments).env_remove("GRADUS_PORT");
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Starts a command, and reads its first lines.
fn started(command: &mut Command, lines: usize) -> (Child, BufReader<ChildStdout>) {
    let mut process = command.spawn().unwrap();
    let mut output = BufReader::new(process.stdout.take().unwrap());
    for _ in 0..lines {
        output.read_line(&mut String::new()).unwrap();
    }
    (process, output)
}

fn signal(process: &Child, name: &str) {
    Command::new("kill").args([&format!("-{name}"), &process.id().to_string()]).status().unwrap();
}

/// Waits for the end: status and standard error output.
fn end(mut process: Child) -> (Option<i32>, String) {
    let start = Instant::now();
    let status = loop {
        match process.try_wait().unwrap() {
            Some(status) => break status,
            None if start.elapsed() > PATIENCE => panic!("it does not end"),
            None => thread::sleep(Duration::from_millis(10)),
        }
    };
    let mut errors = String::new();
    process.stderr.take().unwrap().read_to_string(&mut errors).unwrap();
    (status.code(), errors)
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout)
}

fn speed(url: &str) -> i32 {
    Session::open(&url.parse().unwrap()).unwrap().get_axis(Ap::TargetSpeed, 0).unwrap()
}

#[test]
fn ctrl_c_ends_a_run_with_130_and_stops_program_and_motors() {
    let (sim, folder) = (Sim::start(), folder());
    let run = || started(&mut gradus(folder.path(), &["run", "turn.tmc", "--port", &sim.url, "--every", "100ms"]), 3);
    for (name, status) in [("INT", 130), ("TERM", 143)] {
        let (process, _output) = run();
        assert_eq!(speed(&sim.url), 10_000);
        signal(&process, name);
        let (code, errors) = end(process);
        assert_eq!(code, Some(status), "{errors}");
        assert!(errors.ends_with("error: interrupted; program and motors are stopped\n"), "{errors}");
        assert_eq!(speed(&sim.url), 0);
    }
    let (process, output) = run();
    drop(output);
    assert_eq!(end(process).0, Some(0), "nobody reads any more");
    assert_eq!(speed(&sim.url), 0);
}

#[test]
fn a_command_that_waits_for_its_peer_ends_at_once() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("tcp:{}?timeout=60000", listener.local_addr().unwrap());
    for (name, status) in [("INT", 130), ("TERM", 143)] {
        let process = gradus(Path::new("."), &["get", "1", "--port", &url]).spawn().unwrap();
        let (_connection, _) = listener.accept().unwrap();
        signal(&process, name);
        assert_eq!(end(process).0, Some(status));
    }
}

#[test]
fn a_second_ctrl_c_ends_a_run_that_gets_no_answers() {
    let (mut sim, folder) = (Sim::start(), folder());
    let url = format!("{}?timeout=60000", sim.url);
    let (process, _output) = started(&mut gradus(folder.path(), &["run", "turn.tmc", "--port", &url]), 2);
    writeln!(sim.console, "hang 1").unwrap();
    thread::sleep(Duration::from_millis(300));
    signal(&process, "INT");
    thread::sleep(Duration::from_millis(300));
    signal(&process, "INT");
    assert_eq!(end(process).0, Some(130));
}

#[test]
fn a_module_that_restarts_during_a_run_is_noticed() {
    let (mut sim, folder) = (Sim::start(), folder());
    let (process, _output) = started(&mut gradus(folder.path(), &["run", "turn.tmc", "--port", &sim.url]), 2);
    thread::sleep(Duration::from_millis(300));
    write!(sim.console, "power off\npower on\n").unwrap();
    let (code, errors) = end(process);
    assert_eq!(code, Some(1), "{errors}");
    assert!(errors.contains("the module restarted while the program ran"), "{errors}");
}

#[test]
fn a_port_of_the_environment_is_named_and_asked_about() {
    let (sim, folder) = (Sim::start(), folder());
    let with = |arguments: &[&str]| gradus(folder.path(), arguments).env("GRADUS_PORT", &sim.url).output().unwrap();
    let note = format!("(port {} from GRADUS_PORT)", sim.url);
    let get = with(&["get", "1"]);
    assert!(get.status.success() && text(&get).starts_with(&note), "{}", text(&get));
    let refused = with(&["run", "turn.tmc", "--for", "0s"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(text(&refused).contains("--yes"), "{}", text(&refused));
    assert!(with(&["run", "turn.tmc", "--for", "0s", "--yes"]).status.success());
    let wrong = gradus(folder.path(), &["get", "1"]).env("GRADUS_PORT", "bus:1").output().unwrap();
    assert!(text(&wrong).starts_with("error: GRADUS_PORT: `bus:1` is no port"), "{}", text(&wrong));
}

#[test]
fn a_gradus_toml_above_gives_module_port_and_constants() {
    let folder = tempfile::tempdir().unwrap();
    let deep = folder.path().join("a/b");
    fs::create_dir_all(&deep).unwrap();
    fs::write(deep.join("c.tmc"), "WAIT TICKS, 0, Time").unwrap();
    let toml = |text: &str| fs::write(folder.path().join("gradus.toml"), text).unwrap();
    toml("module = 'tmcm-351'\ndefines = { Time = 2 }");
    let run = gradus(&deep, &["run", "c.tmc"]).output().unwrap();
    assert!(run.status.success() && text(&run).starts_with("(virtual tmcm-351)"), "{}", text(&run));
    toml("port = 'sim:tmcm-1617'");
    let get = gradus(&deep, &["get", "1"]).output().unwrap();
    assert!(text(&get).starts_with("(port sim:tmcm-1617 from ../../gradus.toml)"), "{}", text(&get));
}

#[test]
fn standard_input_and_output_are_files_too() {
    let pipe = |arguments: &[&str], input: &[u8]| {
        let mut process = gradus(Path::new("/"), arguments).stdin(Stdio::piped()).spawn().unwrap();
        process.stdin.take().unwrap().write_all(input).unwrap();
        process.wait_with_output().unwrap()
    };
    let program = pipe(&["asm", "-"], b"STOP");
    assert_eq!(program.stdout, [28, 0, 0, 0, 0, 0, 0, 28], "{}", text(&program));
    assert!(program.stderr.starts_with(b"-: 1 of 6144 commands"), "{}", String::from_utf8_lossy(&program.stderr));
    let source = text(&pipe(&["disasm", "-"], &program.stdout));
    assert_eq!(source.lines().last().map(str::trim), Some("STOP"), "{source}");
    let run = text(&pipe(&["run", "-"], b"STOP"));
    assert!(run.contains("the program stopped at <stdin>:1"), "{run}");
}

#[test]
fn a_result_goes_into_a_file_beside_the_words() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("refused.tmc"), "CALC LOAD, 99\nAAP 140, 0").unwrap();
    let run = gradus(folder.path(), &["run", "refused.tmc", "--json=result.json"]).output().unwrap();
    assert_eq!(run.status.code(), Some(3));
    assert!(text(&run).contains("refused at refused.tmc:2: AAP 140, 0: invalid value"), "{}", text(&run));
    let result = fs::read_to_string(folder.path().join("result.json")).unwrap();
    let result: serde_json::Value = serde_json::from_str(&result).unwrap();
    assert_eq!((&result["version"], &result["end"]), (&1.into(), &"stopped".into()));
    assert_eq!((&result["refused"][0]["place"], &result["moving"]), (&"refused.tmc:2".into(), &serde_json::json!([])));
}

#[test]
fn a_problem_code_is_explained() {
    let page = gradus(Path::new("/"), &["explain", "Jump-To-Next"]).output().unwrap();
    assert!(text(&page).starts_with("# jump-to-next\n"), "{}", text(&page));
    let wrong = gradus(Path::new("/"), &["explain", "jump-to-nxt"]).output().unwrap();
    assert!(text(&wrong).contains("nor a problem code; did you mean `jump-to-next`?"), "{}", text(&wrong));
}
