//! Captures: parameters that the module itself samples, at a rate that no line could carry (command 142).

use std::time::Duration;

use gradus_tmcl::catalogue::Ap;
use gradus_tmcl::{CaptureAction, CaptureInfo, CaptureSource, CaptureState, CaptureTrigger, Instruction, Opcode};

use crate::line::Job;
use crate::{Error, Session};

/// Samples of some parameters of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Capture {
    /// Time from one row to the next.
    pub period: Duration,
    /// One row a sample, one value a parameter.
    pub rows: Vec<Vec<i32>>,
}

impl Capture {
    /// The values of one parameter.
    pub fn column(&self, index: usize) -> Vec<i32> {
        self.rows.iter().filter_map(|row| row.get(index).copied()).collect()
    }
}

/// How long a module may take longer than its samples do.
const PATIENCE: Duration = Duration::from_secs(2);

impl Session {
    /// Samples parameters of an axis for about `time`, while `act` is done and afterwards: as fast as the module can,
    /// or slower where its memory would be too short.
    ///
    /// # Errors
    /// When the module knows no captures or lacks a parameter, when `act` fails, or the line is broken.
    pub fn capture(
        &mut self,
        axis: u8,
        parameters: &[Ap],
        time: Duration,
        act: impl FnOnce(&mut Self) -> Result<(), Error>,
    ) -> Result<Capture, Error> {
        let job = self.line().job();
        let channels = parameters.len().max(1) as u32;
        let base = Duration::from_secs(1) / self.capture_info(CaptureInfo::BASE_RATE)?.max(1);
        let room = (self.capture_info(CaptureInfo::SAMPLES)? / channels).max(1);
        let wanted = (time.as_nanos() / base.as_nanos()).clamp(1, u128::from(u32::MAX)) as u32;
        let (every, rows) = (wanted.div_ceil(room), wanted.min(room));
        self.control_capture(CaptureAction::INIT, 0, 0)?;
        self.control_capture(CaptureAction::SET_PRESCALER, 0, every as i32 - 1)?;
        self.control_capture(CaptureAction::SET_LENGTH, 0, (rows * channels) as i32)?;
        for parameter in parameters {
            let number = self.axis_parameter(*parameter)?.number();
            let select = i32::from(axis) << 24 | i32::from(number);
            self.control_capture(CaptureAction::SET_CHANNEL, CaptureSource::AXIS_PARAMETER.0, select)?;
        }
        self.control_capture(CaptureAction::ENABLE_TRIGGER, CaptureTrigger::UNCONDITIONAL.0, 0)?;
        act(self)?;
        self.wait_captured(base * every * rows, job)?;
        let samples = self.samples(job)?;
        Ok(Capture { period: base * every, rows: samples.chunks(channels as usize).map(<[i32]>::to_vec).collect() })
    }

    fn wait_captured(&mut self, time: Duration, job: Job) -> Result<(), Error> {
        let deadline = self.now() + time + PATIENCE;
        self.sleep(time);
        while self.control_capture(CaptureAction::GET_STATE, 0, 0)? != i32::from(CaptureState::COMPLETE.0)
            && self.now() < deadline
        {
            self.line().go_on(job)?;
            self.sleep(Duration::from_millis(10));
        }
        Ok(())
    }

    fn samples(&mut self, job: Job) -> Result<Vec<i32>, Error> {
        let count = self.capture_info(CaptureInfo::CAPTURED)?;
        let mut sample = |index| {
            self.line().go_on(job)?;
            self.control_capture(CaptureAction::GET_SAMPLE, 0, index)
        };
        (0..count as i32).map(&mut sample).collect()
    }

    fn capture_info(&mut self, info: CaptureInfo) -> Result<u32, Error> {
        Ok(self.control_capture(CaptureAction::GET_INFO, 0, i32::from(info.0))?.max(0) as u32)
    }

    fn control_capture(&mut self, action: CaptureAction, motor: u8, value: i32) -> Result<i32, Error> {
        self.command(Instruction::new(Opcode::CAPTURE, action.0, motor, value))
    }
}
