//! `gradus stats`

use std::io::Write;

use anyhow::bail;
use gradus_host::Statistics;
use gradus_tmcl::catalogue::Gp;
use serde_json::{Value, json};

use crate::json::Json;
use crate::port::Port;

/// Ask a module many times and tell what the line is like
///
/// Reads a parameter over and over and prints how long the answers took, how many requests were sent again, and how many answers
/// came damaged, late or not at all. Nothing is changed. The same figures come at the end of any command with --verbose.
///
/// Exit status: 0 when every request got its answer, with repeating; 1 when some did not.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus stats --port /dev/ttyACM0
  gradus stats --port 'can:can0?id=1&reply=2' --count 10000")]
pub struct Stats {
    #[command(flatten, next_help_heading = "Connection")]
    port: Port,
    /// Number of requests
    #[arg(long, value_name = "N", default_value_t = 1000)]
    count: u32,
    #[command(flatten)]
    json: Json,
}

impl Stats {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let mut session = self.port.open()?;
        session.module()?;
        session.reset_statistics();
        let mut failed = 0;
        for _ in 0..self.count {
            match session.get_global(Gp::TickTimer, 0) {
                Ok(_) => {}
                Err(error) if error.is_passing() => failed += 1,
                Err(error) => return Err(error.into()),
            }
        }
        if !self.json.is_alone() {
            write!(out, "{}", session.statistics())?;
        }
        self.json.write(&members(session.statistics()), out)?;
        if failed > 0 { bail!("{failed} of {} requests got no answer", self.count) } else { Ok(()) }
    }
}

/// The figures for programs; times in microseconds.
fn members(statistics: &Statistics) -> Vec<(&'static str, Value)> {
    let Statistics { requests, answers, retries, silent, damaged, damaged_requests, drained, probes, round_trips } =
        statistics;
    let percentile = |percent| json!(round_trips.percentile(percent).as_micros() as u64);
    vec![
        ("requests", json!(requests)),
        ("answers", json!(answers)),
        ("retries", json!(retries)),
        ("silent", json!(silent)),
        ("damaged", json!(damaged)),
        ("damaged_requests", json!(damaged_requests)),
        ("drained", json!(drained)),
        ("probes", json!(probes)),
        (
            "round_trip_us",
            json!({
                "p50": percentile(50), "p99": percentile(99), "longest": round_trips.longest().as_micros() as u64
            }),
        ),
    ]
}
