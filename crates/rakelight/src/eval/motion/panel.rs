//! Curves over time with their limits, and beside them what is what.

use plotters::backend::BitMapBackend;
use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::types::RangedCoordf64;
use plotters::drawing::DrawingArea;
use plotters::element::{PathElement, Rectangle, Text};
use plotters::series::{DashedLineSeries, LineSeries};
use plotters::style::{BLACK, Color, IntoFont, RGBColor, ShapeStyle, WHITE};

use super::pick::Part;

/// Beyond the outermost limit or curve, as a share of the range.
const ROOM: f64 = 0.06;
const GREY: RGBColor = RGBColor(150, 150, 150);
const BAND: RGBColor = RGBColor(243, 244, 248);
/// Pixels: beside the chart, and from one line there to the next.
const EDGE: u32 = 14;
const LEFT: u32 = 92;
const RIGHT: u32 = 150;
const LEADING: i32 = 29;
/// Above the uppermost chart, for the names of parts in two rows.
pub(super) const NAMES_HEIGHT: u32 = 76;

pub(super) struct Panel {
    /// Quantity and unit.
    pub(super) title: String,
    /// Seconds.
    pub(super) duration: f64,
    pub(super) series: Vec<Series>,
    pub(super) limits: Vec<Limit>,
    /// Below the names of the series.
    pub(super) notes: Vec<String>,
}

pub(super) struct Series {
    pub(super) name: String,
    pub(super) colour: RGBColor,
    pub(super) points: Vec<(f64, f64)>,
}

/// A line across the panel.
#[derive(Clone, Copy)]
pub(super) struct Limit {
    at: f64,
    colour: RGBColor,
}

impl Limit {
    pub(super) fn new(at: f64, colour: RGBColor) -> Self {
        Self { at, colour }
    }
}

pub(super) type Area<'a> = DrawingArea<BitMapBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'b, BitMapBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

impl Panel {
    pub(super) fn draw(&self, area: &Area<'_>, parts: &[Part]) -> anyhow::Result<()> {
        let [least, most] = self.range();
        let mut chart = ChartBuilder::on(area)
            .margin_top(8)
            .margin_left(EDGE)
            .margin_right(RIGHT)
            .x_label_area_size(52)
            .y_label_area_size(LEFT)
            .build_cartesian_2d(0.0..self.duration, least..most)?;
        draw_bands(&mut chart, parts, [least, most])?;
        chart
            .configure_mesh()
            .light_line_style(WHITE.mix(0.0))
            .bold_line_style(GREY.mix(0.35))
            .x_labels(14)
            .y_labels(7)
            .x_desc("time, s")
            .y_desc(&self.title)
            .label_style(("sans-serif", 21))
            .axis_desc_style(("sans-serif", 24))
            .draw()?;
        for limit in &self.limits {
            let line = [(0.0, limit.at), (self.duration, limit.at)];
            chart.draw_series(DashedLineSeries::new(line, 10, 6, limit.colour.stroke_width(2)))?;
        }
        for series in &self.series {
            let points = series.points.iter().copied();
            chart.draw_series(LineSeries::new(points, series.colour.stroke_width(2)))?;
        }
        self.draw_legend(area)
    }

    fn draw_legend(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let left = area.dim_in_pixel().0 as i32 - RIGHT as i32 + 18;
        let mut top = 18;
        for series in &self.series {
            let style = series.colour.stroke_width(4);
            area.draw(&PathElement::new([(left, top + 11), (left + 30, top + 11)], style))?;
            area.draw(&text(&series.name, (left + 40, top), 21))?;
            top += LEADING;
        }
        for note in &self.notes {
            area.draw(&text(note, (left, top), 19))?;
            top += LEADING;
        }
        Ok(())
    }

    /// All limits and curves.
    fn range(&self) -> [f64; 2] {
        let curves = self.series.iter().flat_map(|series| &series.points);
        let values = curves
            .map(|(_, value)| *value)
            .chain(self.limits.iter().map(|limit| limit.at));
        let [least, most] = values.fold([0.0_f64; 2], |[least, most], value| [least.min(value), most.max(value)]);
        let room = ROOM * (most - least);
        [least - room, most + room]
    }
}

/// Every other part on a darker ground.
fn draw_bands(chart: &mut Chart<'_, '_>, parts: &[Part], [least, most]: [f64; 2]) -> anyhow::Result<()> {
    let bands = parts.iter().skip(1).step_by(2).map(|part| {
        let corners = [(part.begin, least), (part.begin + part.duration, most)];
        Rectangle::new(corners, ShapeStyle::from(&BAND).filled())
    });
    chart.draw_series(bands)?;
    Ok(())
}

/// The parts' names over their begins, in turn in the lower and the upper row: short parts are narrower than their names.
pub(super) fn draw_names(area: &Area<'_>, parts: &[Part], duration: f64) -> anyhow::Result<()> {
    let width = f64::from(area.dim_in_pixel().0 - EDGE - LEFT - RIGHT);
    for (index, part) in parts.iter().enumerate() {
        let left = f64::from(EDGE + LEFT) + width * part.begin / duration;
        let row = if index % 2 == 0 { 46 } else { 18 };
        area.draw(&text(part.what, (left as i32, row), 21))?;
    }
    Ok(())
}

fn text(what: &str, at: (i32, i32), size: u32) -> Text<'_, (i32, i32), &str> {
    Text::new(what, at, ("sans-serif", size).into_font().color(&BLACK.mix(0.8)))
}
