//! The subcommands, one file each.

mod asm;
mod check;
mod completions;
mod config;
mod direct;
mod disasm;
mod explain;
mod fmt;
mod get;
mod load;
mod lsp;
mod man;
mod params;
mod replay;
mod run;
mod scan;
mod serve;
mod set;
#[cfg(unix)]
mod sim;
mod start;
mod stats;
mod status;
mod stop;
mod trace;
mod tune;
pub mod units;
mod verify;
mod watch;

use std::io::Write;

/// A subcommand with its arguments.
#[derive(clap::Subcommand)]
pub enum Command {
    #[cfg(unix)]
    Sim(sim::Sim),
    Run(run::Run),
    Load(load::Load),
    Start(start::Start),
    Stop(stop::Stop),
    Status(status::Status),
    Watch(watch::Watch),
    Asm(asm::Asm),
    Disasm(disasm::Disasm),
    Check(check::Check),
    Explain(explain::Explain),
    Fmt(fmt::Fmt),
    Verify(verify::Verify),
    Cmd(direct::Direct),
    Get(get::Get),
    Set(set::Set),
    Params(params::Params),
    Config(config::Configure),
    Scan(scan::Scan),
    Serve(serve::Serve),
    Trace(trace::Trace),
    Replay(replay::Replay),
    Stats(stats::Stats),
    Units(units::Units),
    Tune(tune::Tune),
    Lsp(lsp::Lsp),
    Completions(completions::Completions),
    Man(man::Man),
}

impl Command {
    /// False for a command that deals with signals by itself, and keeps to those that its starter ignores.
    pub fn ends_on_signals(&self) -> bool {
        #[cfg(unix)]
        return !matches!(self, Self::Sim(_));
        #[cfg(not(unix))]
        true
    }

    /// Does it, and prints to `out`.
    ///
    /// # Errors
    /// Whatever went wrong, for the last line of the program.
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        match self {
            #[cfg(unix)]
            Self::Sim(sim) => sim.run(out),
            Self::Run(run) => run.run(out),
            Self::Load(load) => load.run(out),
            Self::Start(start) => start.run(out),
            Self::Stop(stop) => stop.run(out),
            Self::Status(status) => status.run(out),
            Self::Watch(watch) => watch.run(out),
            Self::Asm(asm) => asm.run(out),
            Self::Disasm(disasm) => disasm.run(out),
            Self::Check(check) => check.run(out),
            Self::Explain(explain) => explain.run(out),
            Self::Fmt(fmt) => fmt.run(out),
            Self::Verify(verify) => verify.run(out),
            Self::Cmd(direct) => direct.run(out),
            Self::Get(get) => get.run(out),
            Self::Set(set) => set.run(out),
            Self::Params(params) => params.run(out),
            Self::Config(config) => config.run(out),
            Self::Scan(scan) => scan.run(out),
            Self::Serve(serve) => serve.run(out),
            Self::Trace(trace) => trace.run(out),
            Self::Replay(replay) => replay.run(out),
            Self::Stats(stats) => stats.run(out),
            Self::Units(units) => units.run(out),
            Self::Tune(tune) => tune.run(out),
            Self::Lsp(lsp) => lsp.run(out),
            Self::Completions(completions) => completions.run(out),
            Self::Man(man) => man.run(out),
        }
    }
}
