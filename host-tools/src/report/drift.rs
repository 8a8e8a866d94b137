//! A drift measurement told to a person: text for a terminal, and one HTML file with its plots.

use crate::drift::answer::{Answer, Measured, Separated};
use crate::drift::places::Value;
use crate::drift::uncertainty::{Part, together};
use crate::drift::{DEG_H, advise::Advice, platform::GyroAnswer};
use crate::report::page::{Page, escaped, swatch};
use crate::report::plot::svg::Drawing;
use crate::report::plot::{Axis, Plot, with_margin};
use crate::report::{plain, significant, with_sigma};
use crate::statistics::Extremes;

fn value(name: &str, unit: &str, v: &Value, scale: f64) -> String {
    let shown = v.sigma.map_or(significant(v.value / scale, 5), |sigma| with_sigma(v.value / scale, sigma / scale));
    format!("{name} {shown} {unit}")
}

fn lines(found: &Separated) -> Vec<String> {
    let names: &[&str] = if found.own_rad_s.len() == 3 { &["x ", "y ", "z "] } else { &[""] };
    let mut lines = Vec::new();
    for (name, v) in names.iter().zip(&found.own_rad_s) {
        lines.push(value(&format!("own drift {name}"), "°/h", v, DEG_H));
    }
    for (name, v) in names.iter().zip(&found.apparent_rad_s) {
        lines.push(value(&format!("apparent drift {name}"), "°/h", v, DEG_H));
    }
    match &found.azimuth_rad {
        Some(v) => {
            let other =
                found.other_azimuth_rad().map(|other| format!(", or {}: positions 0,90,180,270 tell which", plain(other.to_degrees(), 5)));
            lines.push(value("azimuth", "°", v, 1_f64.to_radians()) + &other.unwrap_or_default());
        }
        None => lines.push("azimuth not known: it takes the latitude, and an apparent drift below the Earth's horizontal rate".to_owned()),
    }
    if found.own_rad_s.iter().all(|v| v.sigma.is_none()) {
        lines.push("no uncertainty: that takes two cycles of each sequence in each position".to_owned());
    }
    for (name, unequal) in names.iter().zip(&found.unequal) {
        let percent = Value { value: 100.0 * unequal.inequality.value, sigma: unequal.inequality.sigma.map(|s| 100.0 * s) };
        lines.push(value(&format!("by two amplitudes: negative pulses {name}stronger by"), "%, taken off", &percent, 1.0));
    }
    if let Some(places) = &found.places {
        for (v, axis) in places.by_g.iter().zip(["sensitive", "output", "spin"]) {
            lines.extend(v.as_ref().map(|v| value(&format!("by gravity along the {axis} axis"), "°/h/g", v, DEG_H)));
        }
    }
    lines
}

fn bad_lines(measured: &Measured) -> Vec<String> {
    let bad = measured.cycles.iter().filter_map(|cycle| cycle.bad.as_ref().map(|why| (cycle, why)));
    bad.map(|(cycle, why)| format!("cycle {} at {} s is bad: {why}; it enters no mean", cycle.number, plain(cycle.start_s, 5))).collect()
}

/// For a terminal.
pub fn text(answer: &Answer) -> String {
    let m = &answer.measured;
    let good = m.cycles.iter().filter(|cycle| cycle.bad.is_none()).count();
    let pulse_s = m.cycles.iter().find(|c| c.bad.is_none()).map_or(0.0, |c| c.integral.pulse_s);
    let mut out = format!("{}: {good} of {} cycles, pulses of {} s\n", m.name, m.cycles.len(), plain(pulse_s, 5));
    for line in lines(&answer.corrected) {
        out += &format!("  {line}\n");
    }
    if let Some(w) = answer.reference_rad_s {
        out += &format!("  reference {} °/s by the unswitched sums\n", significant(w.to_degrees(), 5));
    }
    out += "as it is, without the corrections:\n";
    for line in lines(&answer.uncorrected) {
        out += &format!("  {line}\n");
    }
    for line in bad_lines(m).iter().chain(&m.warnings) {
        out += &format!("{line}\n");
    }
    out
}

/// One HTML file.
pub fn html(answer: &Answer) -> String {
    let m = &answer.measured;
    let mut page = Page::new(&format!("drift {}", m.name));
    page.push("<p class=\"lead\">");
    page.push(&lines(&answer.corrected).iter().map(|line| escaped(line)).collect::<Vec<_>>().join("; "));
    page.push("</p>");
    for line in bad_lines(m).iter().chain(&m.warnings) {
        page.paragraph("warn", line);
    }
    page.push("<section><h2>Cycles</h2>");
    page.figure(
        &cycles_plot(answer),
        &format!("drift rate of each cycle, {} corrected by the current, {} as it is", swatch("residual", ""), swatch("measured", "")),
    );
    page.push("<div class=\"scroll\"><table><thead><tr><th>cycle</th><th>turned</th><th>sequence</th><th>pulses, °/s</th><th>drift, °/h</th><th>as it is</th><th>by slope</th><th></th></tr></thead><tbody>");
    for c in &m.cycles {
        let number = |x: f64| format!("<td class=\"number\">{}</td>", significant(x / DEG_H, 5));
        page.push(&format!(
            "<tr><td>{}</td><td class=\"number\">{}°</td><td>{}</td><td class=\"number\">{}</td>{}{}{}<td class=\"warn\">{}</td></tr>",
            c.number,
            plain(c.place.turned_rad.to_degrees(), 5),
            if c.sign < 0 { "− +" } else { "+ −" },
            significant(c.amplitude_rad_s.to_degrees(), 3),
            number(c.rate_rad_s()),
            number(c.integral.drift_rad_s()),
            number(c.integral.slope_rad_s),
            escaped(c.bad.as_deref().unwrap_or(""))
        ));
    }
    page.push("</tbody></table></div></section>");
    for (axis, parts) in answer.parts.iter().enumerate() {
        uncertainty(&mut page, if m.has_three_axes { [" about x", " about y", " about z"][axis] } else { "" }, parts);
    }
    page.push("<section><h2>Without the corrections</h2>");
    for line in lines(&answer.uncorrected) {
        page.paragraph("", &line);
    }
    page.push("</section>");
    page.finish()
}

fn uncertainty(page: &mut Page, about: &str, parts: &[Part]) {
    page.push(&format!("<section><h2>Uncertainty{about}</h2><div class=\"scroll\"><table><thead><tr><th>of</th><th>own drift, °/h</th><th>apparent, °/h</th><th>azimuth, ′</th></tr></thead><tbody>"));
    let cell = |x: Option<f64>, unit: f64| format!("<td class=\"number\">{}</td>", x.map_or("–".to_owned(), |x| significant(x / unit, 2)));
    let mut row = |of: &str, [own, apparent, azimuth]: [Option<f64>; 3]| {
        let cells = [cell(own, DEG_H), cell(apparent, DEG_H), cell(azimuth, 60.0 * DEG_H)];
        page.push(&format!("<tr><td>{of}</td>{}</tr>", cells.concat()));
    };
    for part in parts {
        row(part.of, [part.own_rad_s, part.apparent_rad_s, part.azimuth_rad]);
    }
    row("together", [together(parts, |p| p.own_rad_s), together(parts, |p| p.apparent_rad_s), together(parts, |p| p.azimuth_rad)]);
    page.push("</tbody></table></div></section>");
}

fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.min_max()
}

fn cycles_plot(answer: &Answer) -> Drawing {
    let good: Vec<_> = answer.measured.cycles.iter().filter(|c| c.bad.is_none()).collect();
    let (low, high) = range(good.iter().flat_map(|c| [c.rate_rad_s() / DEG_H, c.integral.drift_rad_s() / DEG_H]));
    let last = answer.measured.cycles.len() as f64;
    let mut plot = Plot::new(
        Axis::new((0.0, last + 1.0), 10, "cycle", ""),
        Axis::new(with_margin((low, high)), 6, "drift rate, own + apparent", "°/h"),
        980.0,
        280.0,
    );
    for (k, c) in answer.measured.cycles.iter().enumerate() {
        let x = k as f64 + 1.0;
        if c.bad.is_some() {
            plot.shade(x - 0.4, x + 0.4, "held");
            continue;
        }
        plot.lines(&[vec![(x, c.integral.drift_rad_s() / DEG_H)]], "measured");
        plot.dot((x, c.rate_rad_s() / DEG_H), 3.0, "mean");
    }
    plot.finish()
}

/// Advice for a terminal.
pub fn advice_text(name: &str, advice: &Advice) -> String {
    let mut out = String::new();
    if advice.period_s > 0.0 {
        out +=
            &format!("{name}: pulses of {} s, {} periods of {} s\n", plain(advice.pulse_s, 5), advice.periods, plain(advice.period_s, 5));
        out += &format!(
            "  all lines together leave at most {} °/h in a cycle; with the duration that was wanted {} °/h\n",
            significant(advice.leaves_rad_s[0] / DEG_H, 3),
            significant(advice.leaves_rad_s[1] / DEG_H, 3)
        );
    } else {
        out += &format!("{name}: no line stands out of the noise; pulses of {} s will do\n", plain(advice.pulse_s, 5));
    }
    out += &format!("  the noise scatters a cycle by {} °/h\n", significant(advice.noise_rad_s / DEG_H, 3));
    for line in &advice.lines {
        out += &format!("  line at {} Hz, amplitude {}″\n", significant(line.frequency_Hz, 4), significant(line.amplitude_rad / DEG_H, 3));
    }
    out
}

/// Advice as one HTML file.
pub fn advice_html(name: &str, advice: &Advice) -> String {
    let mut page = Page::new(&format!("drift advise {name}"));
    for (k, line) in advice_text(name, advice).lines().enumerate() {
        page.paragraph(if k == 0 { "lead" } else { "" }, line);
    }
    let shown: Vec<(f64, f64)> = advice.spectrum.iter().map(|(f, a)| (f.log10(), (a / DEG_H).max(1e-9).log10())).collect();
    let (low, high) = range(shown.iter().map(|(_, y)| *y));
    let (from, to) = range(shown.iter().map(|(x, _)| *x));
    let mut plot = Plot::new(
        Axis::new((from, to), 8, "log₁₀ of the frequency in Hz", ""),
        Axis::new(with_margin((low.max(high - 8.0), high)), 6, "log₁₀ of the amplitude in ″", ""),
        980.0,
        300.0,
    );
    plot.lines(&[shown], "modelled");
    for line in &advice.lines {
        plot.dot((line.frequency_Hz.log10(), (line.amplitude_rad / DEG_H).log10()), 3.5, "mean");
    }
    page.figure(&plot.finish(), "the angle sensor's spectrum; dots: lines that were taken into account");
    page.finish()
}

/// A gyro on the platform, for a terminal.
pub fn platform_text(name: &str, answer: &GyroAnswer) -> String {
    let shown = |(value, sigma): (f64, Option<f64>)| sigma.map_or(significant(value, 7), |sigma| with_sigma(value, sigma));
    format!("{name}: {} cycles\n  bias  {} rad/s\n  scale {}\n", answer.cycles.len(), shown(answer.bias_rad_s), shown(answer.scale))
}
