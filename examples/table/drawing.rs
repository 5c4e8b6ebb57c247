//! A picture of curves: bytes against error, both in logarithms.

use super::curves::Point;
use anyhow::anyhow;
use plotters::coord::combinators::WithKeyPoints;
use plotters::prelude::*;

/// A line of a picture.
pub struct Curve {
    pub name: &'static str,
    pub points: Vec<Point>,
}

/// An SVG file; its ground is white whatever is behind it.
///
/// # Errors
/// Where there is nothing to draw.
pub fn draw(title: &str, curves: &[Curve]) -> anyhow::Result<String> {
    let mut text = String::new();
    render(title, curves, &mut text).map_err(|e| anyhow!("{title}: {e}"))?;
    Ok(text)
}

fn render(title: &str, curves: &[Curve], text: &mut String) -> Result<(), Box<dyn std::error::Error>> {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let [bytes, errors] = [|p: &Point| p.0, |p: &Point| p.1].map(|of| {
        let (low, high) =
            points().map(of).fold((f64::MAX, 0.0f64), |(low, high), x| (low.min(x), high.max(x)));
        (low / 1.2, high * 1.2)
    });
    // The names stand in the upper right corner: above all curves.
    let errors = (errors.0, errors.1 * 2.0);
    if bytes.0 > bytes.1 {
        return Err("there are no points".into());
    }
    let area = SVGBackend::with_string(text, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .caption(title, (FONT, 18))
        .margin(12)
        .margin_right(30)
        .x_label_area_size(46)
        .y_label_area_size(72)
        .build_cartesian_2d(axis(bytes), axis(errors))?;
    chart
        .configure_mesh()
        .bold_line_style(BLACK.mix(0.2))
        .max_light_lines(0)
        .label_style((FONT, 14))
        .axis_desc_style((FONT, 15))
        .x_desc("bytes")
        .y_desc("mean error, % of the diagonal")
        .x_label_formatter(&|&bytes| size(bytes))
        .y_label_formatter(&|error| format!("{error}"))
        .draw()?;
    for (curve, (colour, dash)) in curves.iter().zip(STYLES) {
        let style = colour.stroke_width(2);
        let line = curve.points.iter().copied();
        let series = match dash {
            0 => chart.draw_series(LineSeries::new(line, style))?,
            dash => chart.draw_series(DashedLineSeries::new(line, dash, dash / 2 + 3, style))?,
        };
        // A gap round the mark in the middle tells a dashed line.
        let end = if dash == 0 { 12 } else { 7 };
        series.label(curve.name).legend(move |at| {
            EmptyElement::at(at)
                + PathElement::new([(0, 0), (end, 0)], style)
                + PathElement::new([(24 - end, 0), (24, 0)], style)
                + Circle::new((12, 0), 3, colour.filled())
        });
        chart.draw_series(curve.points.iter().map(|&point| Circle::new(point, 3, colour.filled())))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .legend_area_size(34)
        .label_font((FONT, 14))
        .background_style(WHITE.mix(0.9))
        .border_style(BLACK.mix(0.4))
        .draw()?;
    area.present()?;
    Ok(())
}

/// A logarithmic axis with marks at 1, 2 and 5 times the powers of ten.
fn axis((low, high): (f64, f64)) -> WithKeyPoints<LogCoord<f64>> {
    let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let marks = decades.flat_map(|decade| [1.0, 2.0, 5.0].map(|digit| mark(digit, decade)));
    let marks = marks.filter(|mark| (low..=high).contains(mark)).collect();
    (low..high).log_scale().with_key_points(marks)
}

/// A digit times a power of ten, as the nearest number, so that it is written shortly.
fn mark(digit: f64, decade: i32) -> f64 {
    if decade < 0 { digit / 10f64.powi(-decade) } else { digit * 10f64.powi(decade) }
}

fn size(bytes: f64) -> String {
    if bytes < 1000.0 { format!("{bytes} B") } else { format!("{} kB", bytes / 1000.0) }
}

/// Colours that are told apart by colour-blind eyes, too (Okabe and Ito 2008), and dashes; 0 is a whole line.
const STYLES: [(RGBColor, u32); 3] =
    [(RGBColor(0, 114, 178), 0), (RGBColor(0, 158, 115), 9), (RGBColor(213, 94, 0), 4)];
const SIZE: (u32, u32) = (760, 480);
const FONT: &str = "sans-serif";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_has_its_words() {
        let curves = [Curve { name: "one", points: vec![(1e3, 0.5), (1e4, 0.05)] }];
        let text = draw("a title", &curves).unwrap();
        for word in ["<svg", "a title", "one", "bytes", "10 kB", "polyline"] {
            assert!(text.contains(word), "{word}: {text}");
        }
        assert!(draw("nothing", &[]).is_err());
    }
}
