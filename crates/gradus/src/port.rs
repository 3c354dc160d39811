//! Arguments that several subcommands have: the port and the module.

use std::env;
use std::fs::File;
use std::io::{self, IsTerminal};
use std::net::SocketAddr;
use std::ops::{Deref, DerefMut};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use gradus_host::trace::{PcapngWriter, Sink};
use gradus_host::{Line, Place, Session, Terminal, Url};
use gradus_sim::{BenchFile, Eeprom};
use gradus_tmcl::catalogue::{ANY, MODULES, Module, TMCM_3351};

use crate::{complain, project};

/// Where the module is.
#[derive(clap::Args)]
pub struct Port {
    /// Port of the module: sim:MODULE, tcp:HOST:PORT, serial:PATH?baud=9600 or a path, each with ?address=N; can:INTERFACE,
    /// slcan:PATH, slcan:HOST:PORT, socketcand:HOST:PORT/BUS, each with ?id=N&reply=N. If left out, the one of GRADUS_PORT
    /// or of a gradus.toml here or above, or a virtual module of this process.
    #[arg(long, value_name = "URL")]
    port: Option<Url>,
    /// Bench file: a virtual module with the machine it describes, instead of a port
    #[arg(long, value_name = "FILE.toml", conflicts_with = "port")]
    bench: Option<PathBuf>,
    /// Say at the end what the line was like: round trips, repeated requests, damaged and late answers
    #[arg(long, short)]
    verbose: bool,
    /// Record what passes over the line, for `gradus trace`, `gradus replay` and Wireshark
    #[arg(long, value_name = "FILE.pcapng")]
    trace: Option<PathBuf>,
}

/// A session that says at its end what the line was like, if it is asked to.
pub struct Conversation {
    session: Session,
    verbose: bool,
}

impl Deref for Conversation {
    type Target = Session;

    fn deref(&self) -> &Session {
        &self.session
    }
}

impl DerefMut for Conversation {
    fn deref_mut(&mut self) -> &mut Session {
        &mut self.session
    }
}

impl Drop for Conversation {
    fn drop(&mut self) {
        if self.verbose {
            complain(format_args!("{}\n{}", self.session.port(), self.session.statistics().to_string().trim_end()));
        }
    }
}

/// A port with the place that names it.
struct Target {
    url: Url,
    origin: Origin,
}

/// What names a port.
enum Origin {
    /// The command line.
    Flag,
    /// Something else, in words: `GRADUS_PORT`, `../gradus.toml`.
    Elsewhere(String),
    /// Nothing: it is a virtual module of this process.
    Nothing,
}

/// Name of the environment's port.
const VARIABLE: &str = "GRADUS_PORT";

impl Port {
    /// Opens it, or builds the bench.
    ///
    /// # Errors
    /// When it does not open, no module answers, or something is wrong with the bench file.
    pub fn open(&self) -> anyhow::Result<Conversation> {
        self.open_target(&self.target(None)?)
    }

    /// The same for a command that lets a module act by itself: a real one that the command line does not name is asked
    /// about, unless `yes`. `what` is the command in words: `run home.tmc`. Where no port is given, a virtual module of that
    /// kind.
    ///
    /// # Errors
    /// As [`open`](Self::open), and when the answer is no.
    pub fn open_to_act(&self, module: Option<&'static Module>, yes: bool, what: &str) -> anyhow::Result<Conversation> {
        let target = self.target(module)?;
        if !yes {
            target.ask(what)?;
        }
        self.open_target(&target)
    }

    /// Opens the line alone, and asks no module anything.
    ///
    /// # Errors
    /// When it does not open.
    pub fn line(&self) -> anyhow::Result<(Line, Url)> {
        let target = self.target(None)?;
        target.announce();
        let line = Line::open(&target.url)?;
        self.record(&line)?;
        Ok((line, target.url))
    }

    fn open_target(&self, target: &Target) -> anyhow::Result<Conversation> {
        target.announce();
        Ok(Conversation { session: self.session(&target.url)?, verbose: self.verbose })
    }

    /// The command line, the environment, `gradus.toml`, a virtual module: the first that there is.
    fn target(&self, module: Option<&'static Module>) -> anyhow::Result<Target> {
        if self.bench.is_some() {
            return Ok(Target { url: Url::sim(&TMCM_3351), origin: Origin::Flag }); // the bench says which module it has
        }
        if let Some(url) = &self.port {
            return Ok(Target { url: url.clone(), origin: Origin::Flag });
        }
        if let Some(text) = env::var(VARIABLE).ok().filter(|text| !text.is_empty()) {
            return Ok(Target { url: text.parse().context(VARIABLE)?, origin: Origin::Elsewhere(VARIABLE.into()) });
        }
        let project = project::near(Path::new(""))?;
        let module = module.or(project::module(&project)).unwrap_or(&TMCM_3351);
        Ok(match project.port {
            Some(url) => Target { url, origin: Origin::Elsewhere(project.file.display().to_string()) },
            None => Target { url: Url::sim(module), origin: Origin::Nothing },
        })
    }

    /// Opens it for command lines, or builds the bench.
    ///
    /// # Errors
    /// When it does not open, or something is wrong with the bench file.
    pub fn terminal(&self) -> anyhow::Result<Terminal> {
        let Some(file) = &self.bench else {
            let target = self.target(None)?;
            target.announce();
            return Ok(Terminal::open(&target.url)?);
        };
        let file = BenchFile::read(file)?;
        let memory = Eeprom::of(file.module);
        Ok(Terminal::on_bench(file.build(memory)))
    }

    fn session(&self, url: &Url) -> anyhow::Result<Session> {
        let Some(file) = &self.bench else {
            let line = Line::open(url)?;
            self.record(&line)?;
            return Ok(Session::on_line(&line, url)?);
        };
        let file = BenchFile::read(file)?;
        let memory = Eeprom::of(file.module);
        let url = Url::sim(file.module);
        let line = Line::on_bench(file.build(memory));
        self.record(&line)?;
        Ok(Session::on_line(&line, &url)?)
    }

    fn record(&self, line: &Line) -> anyhow::Result<()> {
        if let Some(file) = &self.trace {
            line.trace(recorder(file)?);
        }
        Ok(())
    }
}

/// Nothing comes of what a command leaves in a virtual module that ends with it.
///
/// # Errors
/// When the module is one.
pub fn stays(session: &mut Session) -> anyhow::Result<()> {
    if session.bench().is_some() {
        bail!(
            "{} ends with this command; name a port, or use `gradus run`, or `gradus sim` and its port",
            session.port()
        );
    }
    Ok(())
}

impl Target {
    /// Says on the standard error output which port it is, where the command line does not.
    fn announce(&self) {
        match &self.origin {
            Origin::Flag => {}
            Origin::Elsewhere(origin) => complain(format_args!("(port {} from {origin})", self.url)),
            Origin::Nothing => complain(format_args!("(virtual {})", self.url.to_string().trim_start_matches("sim:"))),
        }
    }

    /// Asks whether a real module that the command line does not name shall act.
    fn ask(&self, what: &str) -> anyhow::Result<()> {
        let (Origin::Elsewhere(origin), false) = (&self.origin, matches!(self.url.place, Place::Sim(_))) else {
            return Ok(());
        };
        let url = &self.url;
        if !io::stdin().is_terminal() {
            bail!(
                "{origin} names the port {url}, not the command line; --yes lets this {what} there, --port names a port"
            );
        }
        complain(format_args!("{what} on {url} (from {origin})? [y/N]"));
        let mut answer = String::new();
        io::stdin().read_line(&mut answer)?;
        let yes = ["y", "yes"].iter().any(|yes| answer.trim().eq_ignore_ascii_case(yes));
        if yes { Ok(()) } else { bail!("nothing was sent") }
    }
}

/// Writes what it gets into a new pcapng file. A file that takes no more is said once; the work goes on.
///
/// # Errors
/// When the file cannot be made.
pub fn recorder(file: &Path) -> anyhow::Result<Sink> {
    let made = File::create(file).and_then(PcapngWriter::new);
    let mut writer = Some(made.with_context(|| format!("cannot write {}", file.display()))?);
    Ok(Box::new(move |record| {
        if let Some(Err(error)) = writer.as_mut().map(|writer| writer.write(record)) {
            complain(format_args!("warning: the trace ends here: {error}"));
            writer = None;
        }
    }))
}

/// Takes the name of a module that programs can be for: those of the catalogue, and `any`.
pub fn program_module() -> impl TypedValueParser<Value = &'static Module> {
    let names = MODULES.iter().copied().chain([&ANY]).map(|module| module.name.to_lowercase());
    PossibleValuesParser::new(names).try_map(|name| project::named(&name).ok_or("the catalogue has no such module"))
}

/// Takes the name of one of these modules.
pub fn module(modules: &'static [&'static Module]) -> impl TypedValueParser<Value = &'static Module> {
    let names = modules.iter().map(|module| module.name.to_lowercase());
    PossibleValuesParser::new(names).try_map(|name| Module::named(&name).ok_or("the catalogue has no such module"))
}

/// An address to listen on.
pub fn address(text: &str) -> Result<SocketAddr, String> {
    gradus_sim::address(text).ok_or_else(|| {
        "a host of this computer and a port are expected: 127.0.0.1:4322, localhost:0, [::1]:4322".into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_a_host_and_a_port() {
        for text in ["127.0.0.1:4322", "localhost:4322", "0.0.0.0:0", "[::1]:4322"] {
            assert!(address(text).is_ok(), "{text}");
        }
        assert!(address("localhost:4322").is_ok_and(|address| address.ip().is_loopback()));
        for text in ["127.0.0.1", "localhost", "4322", ":4322", "127.0.0.1:99999", ""] {
            assert!(address(text).is_err(), "{text}");
        }
    }
}
