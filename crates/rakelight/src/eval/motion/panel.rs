//! Curves over time with their limits.

use plotters::backend::BitMapBackend;
use plotters::chart::{ChartBuilder, ChartContext, SeriesLabelPosition};
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
const BAND: RGBColor = RGBColor(245, 245, 248);

pub(super) struct Panel {
    /// Quantity and unit.
    pub(super) title: String,
    /// Seconds.
    pub(super) duration: f64,
    pub(super) series: Vec<Series>,
    pub(super) limits: Vec<Limit>,
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

type Area<'a> = DrawingArea<BitMapBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'b, BitMapBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

impl Panel {
    pub(super) fn draw(&self, area: &Area<'_>, parts: &[Part]) -> anyhow::Result<()> {
        let [least, most] = self.range();
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .margin_right(24)
            .x_label_area_size(44)
            .y_label_area_size(92)
            .build_cartesian_2d(0.0..self.duration, least..most)?;
        draw_parts(&mut chart, parts, [least, most])?;
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
            let colour = series.colour;
            chart
                .draw_series(LineSeries::new(series.points.iter().copied(), colour.stroke_width(2)))?
                .label(&series.name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 26, y)], colour.stroke_width(4)));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.85))
            .border_style(GREY)
            .label_font(("sans-serif", 20))
            .draw()?;
        Ok(())
    }

    /// All limits and curves.
    fn range(&self) -> [f64; 2] {
        let curves = self
            .series
            .iter()
            .flat_map(|series| series.points.iter().map(|(_, value)| *value));
        let values = curves.chain(self.limits.iter().map(|limit| limit.at)).chain([0.0]);
        let [least, most] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], value| {
            [least.min(value), most.max(value)]
        });
        let room = ROOM * (most - least);
        [least - room, most + room]
    }
}

/// Every other part on a darker ground, with its name.
fn draw_parts(chart: &mut Chart<'_, '_>, parts: &[Part], [least, most]: [f64; 2]) -> anyhow::Result<()> {
    for (index, part) in parts.iter().enumerate() {
        let end = part.begin + part.duration;
        if index % 2 == 1 {
            let style = ShapeStyle::from(&BAND).filled();
            chart.draw_series([Rectangle::new([(part.begin, least), (end, most)], style)])?;
        }
        let name = Text::new(
            part.what,
            (part.begin, least + 0.05 * (most - least)),
            ("sans-serif", 18).into_font().color(&BLACK.mix(0.6)),
        );
        chart.draw_series([name])?;
    }
    Ok(())
}
