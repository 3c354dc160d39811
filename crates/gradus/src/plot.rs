//! Signals over time as a picture: one chart a signal, one curve an axis.

use std::io;

use anyhow::anyhow;
use plotters::coord::Shift;
use plotters::prelude::*;

use crate::recording::{Recording, Sample};

/// Size of a chart in pixels.
const CHART: (u32, u32) = (1000, 350);
/// Points of a curve; more cannot be told apart.
const POINTS: usize = 2000;
/// Space above and below the curves, as a part of their height.
const MARGIN: f64 = 0.05;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type DrawError = DrawingAreaErrorKind<io::Error>;

/// A curve of one axis.
struct Curve {
    axis: u8,
    points: Vec<(f64, f64)>,
}

/// An SVG of the axes on which something changed; of all of them if nothing did.
///
/// # Errors
/// When there is nothing that can be drawn.
pub fn svg(recording: &Recording) -> anyhow::Result<String> {
    let mut text = String::new();
    let size = (CHART.0, CHART.1 * recording.probe.channels.len() as u32);
    draw(&SVGBackend::with_string(&mut text, size).into_drawing_area(), recording)
        .map_err(|error| anyhow!("cannot draw the picture: {error}"))?;
    Ok(text)
}

fn draw(area: &Area, recording: &Recording) -> Result<(), DrawError> {
    let channels = &recording.probe.channels;
    let axes = moved(recording);
    for (index, (area, channel)) in area.split_evenly((channels.len(), 1)).iter().zip(channels).enumerate() {
        let curves: Vec<Curve> = axes.iter().map(|axis| curve(recording, *axis, index)).collect();
        chart(area, &channel.to_string(), &curves)?;
    }
    area.present()
}

/// Indices of the axes on which something changed.
fn moved(recording: &Recording) -> Vec<usize> {
    let all: Vec<usize> = (0..recording.probe.axes.len()).collect();
    let values = |sample: &Sample, axis: usize| sample.axes(&recording.probe).nth(axis).map(<[f64]>::to_vec);
    let Some(first) = recording.samples.first() else { return all };
    let moves = |axis: &usize| {
        let start = values(first, *axis);
        recording.samples.iter().any(|sample| values(sample, *axis) != start)
    };
    let moved: Vec<usize> = all.iter().copied().filter(moves).collect();
    if moved.is_empty() { all } else { moved }
}

fn curve(recording: &Recording, axis: usize, channel: usize) -> Curve {
    let column = axis * recording.probe.channels.len() + channel;
    let point = |sample: &Sample| (sample.time.as_secs_f64(), sample.values[column]);
    Curve { axis: recording.probe.axes[axis], points: thin(recording.samples.iter().map(point).collect()) }
}

/// Leaves lowest and highest of each group of points, so that no peak is lost.
fn thin(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    if points.len() <= POINTS {
        return points;
    }
    let extremes = |group: &[(f64, f64)]| {
        let by_height = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let mut pair: Vec<(f64, f64)> =
            group.iter().min_by(by_height).into_iter().chain(group.iter().max_by(by_height)).copied().collect();
        pair.sort_by(|a, b| a.0.total_cmp(&b.0));
        pair
    };
    points.chunks(points.len().div_ceil(POINTS / 2)).flat_map(extremes).collect()
}

fn chart(area: &Area, title: &str, curves: &[Curve]) -> Result<(), DrawError> {
    let end = curves.iter().flat_map(|curve| &curve.points).map(|point| point.0).fold(1e-3, f64::max);
    let (low, high) = span(curves);
    let decimals = decimals(high - low);
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(area)
        .margin(10)
        .x_label_area_size(40)
        .y_label_area_size(90)
        .build_cartesian_2d(0.0..end, low..high)?;
    chart
        .configure_mesh()
        .x_desc("time [s]")
        .y_desc(title)
        .max_light_lines(0)
        .y_label_formatter(&|value| format!("{value:.decimals$}"))
        .draw()?;
    for curve in curves {
        let color = Palette99::pick(curve.axis.into()).to_rgba();
        let line = LineSeries::new(curve.points.iter().copied(), &color);
        let legend = move |(x, y)| PathElement::new([(x, y), (x + 20, y)], color);
        chart.draw_series(line)?.label(format!("axis {}", curve.axis)).legend(legend);
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .draw()?;
    Ok(())
}

/// Lowest and highest value of a chart, with some space around the curves.
fn span(curves: &[Curve]) -> (f64, f64) {
    let values =
        || curves.iter().flat_map(|curve| &curve.points).map(|point| point.1).filter(|value| value.is_finite());
    let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    match high - low {
        height if height > 0.0 => (low - height * MARGIN, high + height * MARGIN),
        _ if low.is_finite() => (low - 1.0, high + 1.0),
        _ => (0.0, 1.0),
    }
}

/// Digits after the point with which the labels of an axis of that height differ.
fn decimals(mut height: f64) -> usize {
    let mut decimals = 0;
    while height < 10.0 && decimals < 6 {
        height *= 10.0;
        decimals += 1;
    }
    decimals
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::tests::recording;

    #[test]
    fn only_axes_that_moved_are_drawn() {
        assert_eq!(moved(&recording(10)), [1]);
        assert_eq!(moved(&recording(1)), [0, 1]);
        assert_eq!(moved(&recording(0)), [0, 1]);
    }

    #[test]
    fn thinning_keeps_peaks_and_ends() {
        let speeds = curve(&recording(100_000), 1, 1).points;
        assert!(speeds.len() <= POINTS, "{}", speeds.len());
        assert!(speeds.contains(&(7.77, 1000.0)));
    }

    #[test]
    fn labels_have_the_digits_that_tell_them_apart() {
        for (height, expected) in [(1e6, 0), (10.0, 0), (2.0, 1), (0.1, 2), (0.0, 6)] {
            assert_eq!(decimals(height), expected, "{height}");
        }
    }

    #[test]
    fn curves_fill_their_chart() {
        let curve = |values: &[f64]| Curve { axis: 0, points: values.iter().map(|value| (0.0, *value)).collect() };
        for (values, expected) in [
            (&[10.0, 30.0, f64::NAN][..], (9.0, 31.0)),
            (&[5.0, 5.0], (4.0, 6.0)),
            (&[f64::NAN], (0.0, 1.0)),
            (&[], (0.0, 1.0)),
        ] {
            assert_eq!(span(&[curve(values)]), expected, "{values:?}");
        }
    }

    #[test]
    fn the_picture_has_a_curve_for_each_axis_that_moved() {
        let svg = svg(&recording(100)).unwrap();
        let mentions = |text| svg.matches(text).count();
        assert_eq!((mentions("axis 0"), mentions("axis 1")), (0, 2), "one legend for position, one for speed");
        assert!(svg.contains("position [usteps]") && svg.contains("speed [pps]"));
    }
}
