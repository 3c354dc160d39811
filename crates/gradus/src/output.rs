//! Files that a run writes: pictures, tables and recordings.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Seek, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use mcap::records::MessageHeader;
use serde_json::{Map, Value, json};

use crate::plot;
use crate::recording::{Recording, Sample};
use crate::signal::Channel;

/// What a file holds, which the ending of its name says.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Format {
    /// A picture.
    Svg,
    /// A table, one row a sample.
    Csv,
    /// A recording for Foxglove and whatever else reads MCAP, one topic an axis.
    Mcap,
}

impl Format {
    const ALL: [(&'static str, Self); 3] = [("svg", Self::Svg), ("csv", Self::Csv), ("mcap", Self::Mcap)];

    fn of(file: &Path) -> Option<Self> {
        let extension = file.extension()?.to_str()?;
        Self::ALL.iter().find(|(name, _)| extension.eq_ignore_ascii_case(name)).map(|(_, format)| *format)
    }
}

/// Takes the name of a picture or a table.
///
/// # Errors
/// When its ending is another one.
pub fn plot_file(file: PathBuf) -> Result<PathBuf, &'static str> {
    let fits = matches!(Format::of(&file), Some(Format::Svg | Format::Csv));
    fits.then_some(file).ok_or("the name must end in .svg (a picture) or .csv (a table)")
}

/// Takes the name of a recording.
///
/// # Errors
/// When its ending is another one.
pub fn record_file(file: PathBuf) -> Result<PathBuf, &'static str> {
    let fits = Format::of(&file) == Some(Format::Mcap);
    fits.then_some(file).ok_or("the name must end in .mcap; --plot writes .svg and .csv")
}

/// A file that is open and still empty.
pub struct Output {
    path: PathBuf,
    format: Format,
    file: File,
}

impl Output {
    /// Opens a file. That is done before the program runs, so that no run is lost to a wrong path.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn create(path: &Path) -> anyhow::Result<Self> {
        let file = File::create(path).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(Self { path: path.into(), format: Format::of(path).unwrap_or(Format::Csv), file })
    }

    /// Fills the file.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(self, recording: &Recording) -> anyhow::Result<()> {
        let Self { path, format, file } = self;
        let written = match format {
            Format::Svg => svg(file, recording),
            Format::Csv => csv(file, recording),
            Format::Mcap => mcap(file, recording),
        };
        written.with_context(|| format!("cannot write {}", path.display()))
    }
}

fn svg(mut file: impl Write, recording: &Recording) -> anyhow::Result<()> {
    Ok(file.write_all(plot::svg(recording)?.as_bytes())?)
}

/// Seconds, then the columns of the probe. A value that there is not is an empty field.
fn csv(file: impl Write, Recording { probe, samples, .. }: &Recording) -> anyhow::Result<()> {
    let mut table = csv::Writer::from_writer(file);
    let heading = probe.columns().map(|(axis, channel)| format!("axis {axis} {channel}"));
    table.write_record(std::iter::once("time [s]".into()).chain(heading))?;
    for Sample { time, values } in samples {
        let field = |value: &f64| if value.is_nan() { String::new() } else { value.to_string() };
        table.write_record(std::iter::once(time.as_secs_f64().to_string()).chain(values.iter().map(field)))?;
    }
    Ok(table.flush()?)
}

/// Topics `axis/0`, `axis/1`, ... of JSON objects with a number for each signal. Time 0 is the start of the run.
fn mcap(file: impl Write + Seek, Recording { probe, samples, .. }: &Recording) -> anyhow::Result<()> {
    let options = mcap::WriteOptions::new().compression(None).library(concat!("gradus ", env!("CARGO_PKG_VERSION")));
    let mut writer = options.create(BufWriter::new(file))?;
    let schema = writer.add_schema("gradus.Axis", "jsonschema", schema(&probe.channels).to_string().as_bytes())?;
    let topic = |axis: &u8| writer.add_channel(schema, &format!("axis/{axis}"), "json", &BTreeMap::new());
    let topics = probe.axes.iter().map(topic).collect::<Result<Vec<u16>, _>>()?;
    for (sequence, sample) in (0..).zip(samples) {
        let log_time = u64::try_from(sample.time.as_nanos())?;
        for (channel_id, values) in topics.iter().zip(sample.axes(probe)) {
            let header = MessageHeader { channel_id: *channel_id, sequence, log_time, publish_time: log_time };
            writer.write_to_known_channel(&header, message(&probe.channels, values).to_string().as_bytes())?;
        }
    }
    writer.finish()?;
    Ok(())
}

fn schema(channels: &[Channel]) -> Value {
    let number =
        |channel: &Channel| (channel.name.clone(), json!({ "type": "number", "description": channel.to_string() }));
    json!({ "type": "object", "properties": channels.iter().map(number).collect::<Map<_, _>>() })
}

/// A value that there is not is left out.
fn message(channels: &[Channel], values: &[f64]) -> Value {
    let known = channels.iter().zip(values).filter(|(_, value)| value.is_finite());
    known.map(|(channel, value)| (channel.name.clone(), json!(value))).collect::<Map<_, _>>().into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::tests::recording;

    #[test]
    fn the_ending_of_a_name_says_what_the_file_holds() {
        let file = |name: &str| PathBuf::from(name);
        assert!(["a.svg", "a.SVG", "b/a.csv"].into_iter().all(|name| plot_file(file(name)).is_ok()));
        assert!(["a.mcap", "a.png", "svg", ""].into_iter().all(|name| plot_file(file(name)).is_err()));
        assert!(record_file(file("a.mcap")).is_ok());
        assert!(["a.svg", "a.bag"].into_iter().all(|name| record_file(file(name)).is_err()));
    }

    #[test]
    fn a_table_has_a_row_for_each_sample() {
        let mut recording = recording(3);
        recording.samples[2].values[0] = f64::NAN;
        let mut text = Vec::new();
        csv(&mut text, &recording).unwrap();
        let heading =
            "time [s],axis 0 position [usteps],axis 0 speed [pps],axis 1 position [usteps],axis 1 speed [pps]";
        let rows = ["0,0,0,0,0", "0.01,0,0,1,0", "0.02,,0,2,0"];
        assert_eq!(String::from_utf8(text).unwrap().lines().collect::<Vec<_>>(), [&[heading], &rows[..]].concat());
    }

    #[test]
    fn a_recording_reads_back() {
        let recording = recording(1000);
        let mut file = std::io::Cursor::new(Vec::new());
        mcap(&mut file, &recording).unwrap();
        let bytes = file.into_inner();
        let messages: Vec<mcap::Message> = mcap::MessageStream::new(&bytes).unwrap().collect::<Result<_, _>>().unwrap();
        assert_eq!(messages.len(), 2 * recording.samples.len());
        let fast = &messages[2 * 777 + 1];
        assert_eq!((fast.channel.topic.as_str(), fast.log_time, fast.sequence), ("axis/1", 7_770_000_000, 777));
        assert_eq!(fast.channel.message_encoding, "json");
        let value: Value = serde_json::from_slice(&fast.data).unwrap();
        assert_eq!(value, json!({ "position": 777.0, "speed": 1000.0 }));
        let schema = fast.channel.schema.as_ref().unwrap();
        let schema: Value = serde_json::from_slice(&schema.data).unwrap();
        assert_eq!(schema["properties"]["speed"]["description"], "speed [pps]");
    }
}
