//! Signals over time as a picture: one chart a signal, one curve an axis.

use std::io;

use anyhow::anyhow;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use crate::recording::{Recording, Sample};
use crate::zone::Zone;

/// Size of a chart in pixels.
const CHART: (u32, u32) = (1000, 350);
/// Parts of a pixel: the library draws with whole numbers, which would make steps of a flat slope.
const PX: u32 = 4;
/// Points of a curve; more cannot be told apart.
const POINTS: usize = 2000;
/// Space above and below the curves, as a part of their height.
const MARGIN: f64 = 0.05;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type DrawError = DrawingAreaErrorKind<io::Error>;

/// A curve with its name and colour, and the zones that it runs through.
struct Curve<'a> {
    name: String,
    color: usize,
    points: Vec<(f64, f64)>,
    zones: &'a [Zone],
}

/// A chart of curves that have names: their quantity with its unit, and for each its name and its points over seconds.
pub struct Named<'a> {
    /// The quantity.
    pub title: &'a str,
    /// The curves.
    pub curves: &'a [(&'a str, Vec<(f64, f64)>)],
}

/// An SVG of charts, one below the other.
///
/// # Errors
/// When there is nothing that can be drawn.
pub fn named_svg(charts: &[Named]) -> anyhow::Result<String> {
    svg_of(charts.len(), |area| {
        for (area, Named { title, curves }) in area.split_evenly((charts.len(), 1)).iter().zip(charts) {
            let curves: Vec<Curve> = (0..)
                .zip(*curves)
                .map(|(color, (name, points))| Curve {
                    name: (*name).into(),
                    color,
                    points: thin(points.clone()),
                    zones: &[],
                })
                .collect();
            chart(area, title, &curves)?;
        }
        area.present()
    })
}

/// An SVG of the axes on which something changed; of all of them if nothing did.
///
/// # Errors
/// When there is nothing that can be drawn.
pub fn svg(recording: &Recording) -> anyhow::Result<String> {
    svg_of(recording.probe.channels.len(), |area| draw(area, recording))
}

fn svg_of(charts: usize, draw: impl FnOnce(&Area) -> Result<(), DrawError>) -> anyhow::Result<String> {
    let mut text = String::new();
    let (width, height) = (CHART.0, CHART.1 * charts as u32);
    draw(&SVGBackend::with_string(&mut text, (width * PX, height * PX)).into_drawing_area())
        .map_err(|error| anyhow!("cannot draw the picture: {error}"))?;
    let size = |px: u32| format!(r#"<svg width="{}" height="{}""#, width * px, height * px);
    Ok(text.replacen(&size(PX), &size(1), 1))
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

fn curve(recording: &Recording, axis: usize, channel: usize) -> Curve<'_> {
    let column = axis * recording.probe.channels.len() + channel;
    let point = |sample: &Sample| (sample.time.as_secs_f64(), sample.values[column]);
    let points = thin(recording.samples.iter().map(point).collect());
    let number = recording.probe.axes[axis];
    Curve { name: format!("axis {number}"), color: number.into(), points, zones: &recording.zones[column] }
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
    let times = || curves.iter().flat_map(|curve| &curve.points).map(|point| point.0);
    let (start, end) = (times().fold(0.0, f64::min), times().fold(1e-3, f64::max));
    let (low, high) = span(curves);
    let decimals = decimals(high - low);
    area.fill(&WHITE)?;
    let (head, body) = area.split_vertically(20 * PX);
    let mut chart = ChartBuilder::on(&body)
        .margin(10 * PX)
        .x_label_area_size(40 * PX)
        .y_label_area_size(90 * PX)
        .build_cartesian_2d(start..end, low..high)?;
    for curve in curves {
        shade(&mut chart, curve)?;
    }
    chart
        .configure_mesh()
        .x_desc("time [s]")
        .y_desc(title)
        .max_light_lines(0)
        .bold_line_style(BLACK.mix(0.2).stroke_width(PX))
        .axis_style(BLACK.stroke_width(PX))
        .set_all_tick_mark_size(5 * PX)
        .label_style(FONT)
        .axis_desc_style(FONT)
        .y_label_formatter(&|value| format!("{value:.decimals$}"))
        .draw()?;
    for curve in curves {
        chart.draw_series(LineSeries::new(curve.points.iter().copied(), color(curve).stroke_width(PX)))?;
    }
    legend(&head, curves)
}

/// The zones of a curve, behind it.
fn shade(chart: &mut Chart, curve: &Curve) -> Result<(), DrawError> {
    let (time, values) = (chart.x_range(), chart.y_range());
    for Zone { name, range: (from, to) } in curve.zones {
        let (from, to) = (from.max(values.start), to.min(values.end));
        if from < to {
            let area = [(time.start, from), (time.end, to)];
            chart.draw_series([Rectangle::new(area, color(curve).mix(0.12).filled())])?;
            chart.draw_series([Text::new(*name, (time.start + (time.end - time.start) * 0.005, to), FONT)])?;
        }
    }
    Ok(())
}

const FONT: (&str, u32) = ("sans-serif", 12 * PX);

/// Colours that colour-blind people can tell apart (Okabe and Ito), without the yellow that white swallows.
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
];

fn color(curve: &Curve) -> RGBAColor {
    COLORS[curve.color % COLORS.len()].to_rgba()
}

/// Which curve is whose, above the chart and out of the way of the curves.
fn legend(area: &Area, curves: &[Curve]) -> Result<(), DrawError> {
    let px = PX as i32;
    for (x, curve) in (100 * px..).step_by(90 * PX as usize).zip(curves) {
        let line = [(x, 14 * px), (x + 20 * px, 14 * px)];
        area.draw(&PathElement::new(line, color(curve).stroke_width(PX)))?;
        area.draw(&Text::new(curve.name.as_str(), (x + 26 * px, 8 * px), FONT))?;
    }
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
        let curve = |values: &[f64]| Curve {
            name: String::new(),
            color: 0,
            points: values.iter().map(|value| (0.0, *value)).collect(),
            zones: &[],
        };
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
        assert_eq!(mentions("home"), 1, "the zone of its home switch");
    }

    #[test]
    fn a_zone_that_no_curve_comes_near_is_left_out() {
        let mut recording = recording(100);
        recording.zones[2][0].range = (200.0, f64::INFINITY);
        assert!(!svg(&recording).unwrap().contains("home"));
    }
}
