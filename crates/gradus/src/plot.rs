//! Position and speed over time as a picture.

use std::io;

use anyhow::anyhow;
use gradus_tmcl::catalogue::{Ap, Module};
use plotters::coord::Shift;
use plotters::prelude::*;

use crate::recording::{Motion, Sample};

/// Size of the picture in pixels.
const SIZE: (u32, u32) = (1000, 700);
/// Points of a curve; more cannot be told apart.
const POINTS: usize = 2000;
/// Space above and below the curves, as a part of their height.
const MARGIN: f64 = 0.05;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type DrawError = DrawingAreaErrorKind<io::Error>;

/// A curve of one axis.
struct Curve {
    axis: usize,
    points: Vec<(f64, f64)>,
}

/// An SVG of the axes that moved; of all of them if none did. The units are those of the module.
///
/// # Errors
/// When there is nothing that can be drawn.
pub fn svg(samples: &[Sample], module: &Module) -> anyhow::Result<String> {
    let mut text = String::new();
    draw(SVGBackend::with_string(&mut text, SIZE).into_drawing_area(), samples, module)
        .map_err(|error| anyhow!("cannot draw the picture: {error}"))?;
    Ok(text)
}

fn draw(area: Area, samples: &[Sample], module: &Module) -> Result<(), DrawError> {
    let axes = moved(samples);
    let (upper, lower) = area.split_vertically(SIZE.1 / 2);
    let positions = curves(samples, &axes, |motion| motion.position);
    let speeds = curves(samples, &axes, |motion| motion.speed);
    chart(&upper, &title(module, Ap::ActualPosition), &positions)?;
    chart(&lower, &title(module, Ap::ActualSpeed), &speeds)?;
    area.present()
}

/// Name and unit of what a picture shows.
fn title(module: &Module, id: Ap) -> String {
    let row = module.axis_parameters.iter().find(|row| row.id == id);
    row.map_or_else(String::new, |row| format!("{} [{}]", row.name, row.unit.text()))
}

fn moved(samples: &[Sample]) -> Vec<usize> {
    let Some(first) = samples.first() else { return Vec::new() };
    let all: Vec<usize> = (0..first.axes.len()).collect();
    let moves = |axis: &usize| samples.iter().any(|sample| sample.axes[*axis] != first.axes[*axis]);
    let moved: Vec<usize> = all.iter().copied().filter(moves).collect();
    if moved.is_empty() { all } else { moved }
}

fn curves(samples: &[Sample], axes: &[usize], of: impl Fn(&Motion) -> i32) -> Vec<Curve> {
    let point = |axis: usize, sample: &Sample| (sample.time.as_secs_f64(), f64::from(of(&sample.axes[axis])));
    let curve =
        |axis: &usize| Curve { axis: *axis, points: thin(samples.iter().map(|sample| point(*axis, sample)).collect()) };
    axes.iter().map(curve).collect()
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
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let end = points().map(|point| point.0).fold(1e-3, f64::max);
    let (low, high) = points().fold((0.0, 1.0), |(low, high): (f64, f64), point| (low.min(point.1), high.max(point.1)));
    let margin = (high - low) * MARGIN;
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(area)
        .margin(10)
        .x_label_area_size(40)
        .y_label_area_size(90)
        .build_cartesian_2d(0.0..end, low - margin..high + margin)?;
    chart
        .configure_mesh()
        .x_desc("time [s]")
        .y_desc(title)
        .max_light_lines(0)
        .y_label_formatter(&|value| format!("{value:.0}"))
        .draw()?;
    for curve in curves {
        let color = Palette99::pick(curve.axis).to_rgba();
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

#[cfg(test)]
mod tests {
    use super::*;
    use gradus_tmcl::catalogue::TMCM_3351;
    use std::time::Duration;

    fn samples(count: u64) -> Vec<Sample> {
        let rest = Motion { position: 0, speed: 0 };
        let sample = |i: u64| Sample {
            time: Duration::from_millis(10 * i),
            axes: vec![rest, Motion { position: i as i32, speed: if i == 777 { 1000 } else { 0 } }],
        };
        (0..count).map(sample).collect()
    }

    #[test]
    fn only_axes_that_moved_are_drawn() {
        assert_eq!(moved(&samples(10)), [1]);
        assert_eq!(moved(&samples(1)), [0, 1]);
    }

    #[test]
    fn thinning_keeps_peaks_and_ends() {
        let speeds = curves(&samples(100_000), &[1], |motion| motion.speed).remove(0).points;
        assert!(speeds.len() <= POINTS, "{}", speeds.len());
        assert!(speeds.contains(&(7.77, 1000.0)));
    }

    #[test]
    fn the_picture_has_a_curve_for_each_axis_that_moved() {
        let svg = svg(&samples(100), &TMCM_3351).unwrap();
        let mentions = |text| svg.matches(text).count();
        assert_eq!((mentions("axis 0"), mentions("axis 1")), (0, 2), "one legend for position, one for speed");
        assert!(svg.contains("actual position [usteps]") && svg.contains("actual speed [pps]"));
    }
}
