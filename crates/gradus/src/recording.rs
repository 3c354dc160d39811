//! What the axes did over time.

use std::time::Duration;

use gradus_host::{Error, Session};

use crate::signal::Channel;
use crate::zone::Zone;

/// What is looked at: each channel of each axis is a column.
pub struct Probe {
    /// The signals.
    pub channels: Vec<Channel>,
    /// Numbers of the axes.
    pub axes: Vec<u8>,
}

/// All columns at one time.
#[derive(Clone, PartialEq, Debug)]
pub struct Sample {
    /// Since the start.
    pub time: Duration,
    /// Axis by axis, in each the channels.
    pub values: Vec<f64>,
}

/// A probe with what it has seen.
pub struct Recording {
    /// What was looked at.
    pub probe: Probe,
    /// The zones of each column, in the order of [`Sample::values`].
    pub zones: Vec<Vec<Zone>>,
    /// In the order of time.
    pub samples: Vec<Sample>,
}

impl Probe {
    /// Looks at everything.
    ///
    /// # Errors
    /// When the session fails.
    pub fn take(&self, session: &mut Session, start: Duration) -> Result<Sample, Error> {
        let time = session.now().saturating_sub(start);
        let values = self.columns().map(|(axis, channel)| channel.read(session, axis)).collect::<Result<_, _>>()?;
        Ok(Sample { time, values })
    }

    /// The zones of each column.
    pub fn zones(&self, session: &mut Session) -> Vec<Vec<Zone>> {
        self.columns().map(|(axis, channel)| channel.zones(session, axis)).collect()
    }

    /// The columns in the order of [`Sample::values`].
    pub fn columns(&self) -> impl Iterator<Item = (u8, &Channel)> {
        self.axes.iter().flat_map(|axis| self.channels.iter().map(|channel| (*axis, channel)))
    }
}

impl Sample {
    /// The values of one axis after the other.
    pub fn axes<'a>(&'a self, probe: &Probe) -> impl Iterator<Item = &'a [f64]> {
        self.values.chunks(probe.channels.len().max(1))
    }
}

/// Recordings for the tests of what shows them.
#[cfg(test)]
pub mod tests {
    use gradus_sim::Bench;
    use gradus_tmcl::catalogue::TMCM_3351;

    use super::*;

    /// Position and speed of axes 0 and 1, every 10 ms, of which the second one moves and is fast for a moment. Its home
    /// switch is closed from 5 on.
    pub fn recording(count: u32) -> Recording {
        let mut session = Session::on_bench(Bench::with_defaults(&TMCM_3351)).unwrap();
        let channels = ["position", "speed"].map(|name| Channel::find(name, &mut session).unwrap());
        let probe = Probe { channels: channels.into(), axes: vec![0, 1] };
        let speed = |i| if i == 777 { 1000.0 } else { 0.0 };
        let sample = |i| Sample { time: Duration::from_millis(10) * i, values: vec![0.0, 0.0, f64::from(i), speed(i)] };
        let zones = vec![Vec::new(), Vec::new(), vec![Zone { name: "home", range: (5.0, f64::INFINITY) }], Vec::new()];
        Recording { probe, zones, samples: (0..count).map(sample).collect() }
    }

    #[test]
    fn a_sample_has_every_channel_of_every_axis() {
        let mut session = Session::on_bench(Bench::with_defaults(&TMCM_3351)).unwrap();
        session.set_axis(gradus_tmcl::catalogue::Ap::TargetSpeed, 2, 1000).unwrap();
        session.sleep(Duration::from_secs(2));
        let channels = ["speed", "max_speed"].map(|name| Channel::find(name, &mut session).unwrap());
        let probe = Probe { channels: channels.into(), axes: vec![2, 0] };
        let sample = probe.take(&mut session, Duration::from_secs(1)).unwrap();
        assert_eq!(sample, Sample { time: Duration::from_secs(1), values: vec![1000.0, 51_200.0, 0.0, 51_200.0] });
        assert_eq!(sample.axes(&probe).collect::<Vec<_>>(), [[1000.0, 51_200.0], [0.0, 51_200.0]]);
    }
}
