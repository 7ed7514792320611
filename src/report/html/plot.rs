//! Plots as SVG.

use super::axis::Axis;
use super::role::Role;
use crate::report::Edition;
use maud::{Markup, PreEscaped, html};
use plotters::coord::Shift;
use plotters::prelude::*;

/// Units of the drawing in a pixel of the page: the backend knows whole numbers only.
const FINE: u32 = 4;
const TEXT: u32 = 15;

/// Something in a panel. Points that are not finite interrupt a line and are left out elsewhere.
pub(super) enum Mark {
    /// A line through points.
    Line(Role, Vec<(f64, f64)>),
    /// Points alone.
    Dots(Role, Vec<(f64, f64)>),
    /// Many small points.
    Specks(Role, Vec<(f64, f64)>),
    /// A vertical stroke at x, from one y to another.
    Bar(Role, f64, (f64, f64)),
    /// A bar from the left edge to x, around y.
    Length(Role, f64, f64),
    /// A line across, at y.
    Level(Role, f64),
    /// A line upright, at x.
    Upright(Role, f64),
    /// The rows from one x to another.
    Span(Role, (f64, f64)),
}

/// One plot.
pub(super) struct Panel {
    /// What it shows.
    pub(super) title: String,
    /// Width and height in pixels.
    pub(super) size: (u32, u32),
    pub(super) x: Axis,
    pub(super) y: Axis,
    /// What is in it, from the bottom to the top.
    pub(super) marks: Vec<Mark>,
}

impl Panel {
    /// The plot below its title, its axes as this `edition` has them.
    pub(super) fn draw(&self, edition: &Edition) -> Markup {
        let axes = [&self.x, &self.y].map(|axis| axis.told(edition));
        let (width, height) = (self.size.0 * FINE, self.size.1 * FINE);
        let mut text = String::new();
        {
            let root = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
            self.draw_on(&root, &axes)
                .expect("a string takes what is drawn");
            root.present().expect("a string takes what is drawn");
        }
        // The head is written below.
        let start = text.find('>').map_or(0, |end| end + 1);
        let content = text[start..].trim_end().trim_end_matches("</svg>");
        html! {
            div.panel.wide[self.size.0 > 600] style=(format!("flex-basis:{}px", self.size.0)) {
                p.title { (self.title) }
                svg role="img" aria-label=(self.label(&axes, edition)) viewBox=(format!("0 0 {width} {height}")) {
                    (PreEscaped(content))
                }
            }
        }
    }

    fn label(&self, [x, y]: &[Axis; 2], edition: &Edition) -> String {
        let [title, over] = [&self.title, "over"].map(|text| edition.text(text));
        match y.label.is_empty() {
            true => format!("{title}: {}", x.label),
            false => format!("{title}: {} {over} {}", y.label, x.label),
        }
    }

    fn draw_on(
        &self,
        root: &DrawingArea<SVGBackend, Shift>,
        [x, y]: &[Axis; 2],
    ) -> Result<(), String> {
        let fine = |pixels: u32| pixels * FINE;
        let text = |pixels: u32| {
            ("sans-serif", fine(pixels))
                .into_font()
                .color(&Role::Text.colour())
        };
        let mut chart = ChartBuilder::on(root)
            .margin_top(fine(10))
            .margin_right(fine(14))
            .margin_left(fine(4))
            .x_label_area_size(fine(38))
            .y_label_area_size(fine(y.room(TEXT)))
            .build_cartesian_2d(x.clone(), y.upright())
            .map_err(|error| error.to_string())?;
        for mark in self
            .marks
            .iter()
            .filter(|mark| matches!(mark, Mark::Span(..)))
        {
            self.draw_mark(&mut chart, mark)?;
        }
        let mut mesh = chart.configure_mesh();
        mesh.bold_line_style(Role::Grid.colour().stroke_width(FINE))
            .light_line_style(TRANSPARENT)
            .axis_style(Role::Text.colour().stroke_width(FINE))
            .label_style(text(TEXT))
            .axis_desc_style(text(TEXT))
            .x_labels(self.size.0 as usize / 80)
            .y_labels(self.size.1 as usize / 36)
            .x_desc(x.label.as_str());
        if !y.label.is_empty() {
            mesh.y_desc(y.label.as_str());
        }
        mesh.draw().map_err(|error| error.to_string())?;
        for mark in self
            .marks
            .iter()
            .filter(|mark| !matches!(mark, Mark::Span(..)))
        {
            self.draw_mark(&mut chart, mark)?;
        }
        Ok(())
    }

    fn draw_mark(&self, chart: &mut Chart<'_, '_>, mark: &Mark) -> Result<(), String> {
        let (x, y) = (&self.x, &self.y);
        let (left, right) = x.ends();
        let (bottom, top) = y.ends();
        let inside = |point: &(f64, f64)| x.holds(point.0) && y.holds(point.1);
        match mark {
            Mark::Line(role, points) => {
                for piece in points.split(|point| !inside(point)) {
                    draw(chart, PathElement::new(self.thinned(piece), line(*role)))?;
                }
                Ok(())
            }
            Mark::Dots(role, points) => {
                let size = 4 * FINE;
                for &point in points.iter().filter(|point| inside(point)) {
                    let colour = role.colour();
                    match role {
                        Role::Before | Role::Second => {
                            draw(chart, TriangleMarker::new(point, size, colour.filled()))?
                        }
                        Role::Rival | Role::Third => draw(
                            chart,
                            Cross::new(point, size, colour.stroke_width(2 * FINE)),
                        )?,
                        _ => draw(chart, Circle::new(point, size, colour.filled()))?,
                    }
                }
                Ok(())
            }
            Mark::Specks(role, points) => {
                for &point in points.iter().filter(|point| inside(point)) {
                    draw(chart, Circle::new(point, FINE, role.colour().filled()))?;
                }
                Ok(())
            }
            Mark::Bar(role, at, (low, high)) if x.holds(*at) => {
                let ends = vec![(*at, y.clamped(*low)), (*at, y.clamped(*high))];
                draw(
                    chart,
                    PathElement::new(ends, role.colour().stroke_width(5 * FINE)),
                )
            }
            Mark::Length(role, to, at) if y.holds(*at) => {
                let ends = [(left, at - 0.3), (x.clamped(*to), at + 0.3)];
                draw(chart, Rectangle::new(ends, role.colour().filled()))
            }
            Mark::Level(role, at) if y.holds(*at) => draw(
                chart,
                PathElement::new(vec![(left, *at), (right, *at)], line(*role)),
            ),
            Mark::Upright(role, at) if x.holds(*at) => draw(
                chart,
                PathElement::new(vec![(*at, bottom), (*at, top)], line(*role)),
            ),
            Mark::Span(role, (from, to)) => {
                let ends = [(x.clamped(*from), bottom), (x.clamped(*to), top)];
                draw(chart, Rectangle::new(ends, role.colour().filled()))
            }
            _ => Ok(()),
        }
    }

    /// At most two points a column of pixels, its lowest and its highest.
    fn thinned(&self, points: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let columns = self.size.0 as usize;
        if points.len() <= 2 * columns {
            return points.to_vec();
        }
        let column = |x: f64| (self.x.share(x) * columns as f64) as usize;
        let mut result = Vec::new();
        for column in points.chunk_by(|a, b| column(a.0) == column(b.0)) {
            let order = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
            let low = column.iter().min_by(order).expect("a chunk is not empty");
            let high = column.iter().max_by(order).expect("a chunk is not empty");
            let (first, second) = if low.0 <= high.0 {
                (low, high)
            } else {
                (high, low)
            };
            result.push(*first);
            if first != second {
                result.push(*second);
            }
        }
        result
    }
}

/// How the lines of a role are drawn.
fn line(role: Role) -> ShapeStyle {
    let width = (role.width() * f64::from(FINE)) as u32;
    role.colour().stroke_width(width)
}

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Axis, Axis>>;

fn draw<'b, E>(chart: &mut Chart<'_, 'b>, element: E) -> Result<(), String>
where
    for<'e> &'e E: plotters::element::PointCollection<'e, (f64, f64)>,
    E: plotters::element::Drawable<SVGBackend<'b>>,
{
    let drawn = chart.draw_series(std::iter::once(element));
    drawn.map(|_| ()).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(points: Vec<(f64, f64)>) -> Panel {
        let finite = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).collect::<Vec<f64>>();
        Panel {
            title: "a <b> & c".into(),
            size: (400, 200),
            x: Axis::over("time [s]", finite(|p| p.0)),
            y: Axis::over("spool [V]", finite(|p| p.1)),
            marks: vec![Mark::Line(Role::Measured, points)],
        }
    }

    #[test]
    fn a_long_line_keeps_its_peaks_in_few_points() {
        let mut points: Vec<(f64, f64)> = (0..60_000).map(|k| (f64::from(k), 0.0)).collect();
        points[31_234].1 = 7.0;
        points[31_240].1 = -3.0;
        let panel = panel(points.clone());
        let thin = panel.thinned(&points);
        assert!(thin.len() <= 2 * 401, "{}", thin.len());
        assert!(thin.contains(&points[31_234]) && thin.contains(&points[31_240]));
        assert!(thin.is_sorted_by(|a, b| a.0 <= b.0));
        assert!(panel.draw(&Edition::default()).into_string().len() < 20_000);
    }

    #[test]
    fn what_is_not_finite_interrupts_a_line_and_text_is_escaped() {
        let points = vec![
            (0.0, 1.0),
            (1.0, 2.0),
            (2.0, f64::NAN),
            (3.0, 1.0),
            (4.0, f64::INFINITY),
            (5.0, 0.0),
            (6.0, 1.0),
        ];
        let text = panel(points).draw(&Edition::default()).into_string();
        assert_eq!(
            text.matches(&format!("stroke=\"{}\"", Role::Measured.hex()))
                .count(),
            3,
            "{text}"
        );
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
        assert!(
            text.contains("a &lt;b&gt; &amp; c") && text.contains("time [s]"),
            "{text}"
        );
    }
}
