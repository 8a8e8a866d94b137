//! An Allan deviation told to a person: text for a terminal, and one HTML file with its curve.

use super::allan_picture as picture;
use crate::allan::answer::{Answer, Coefficient, FLICKER, WHITE};
use crate::allan::request::Take;
use crate::allan::units::{PROCESSES, Process};
use crate::allan::{FLOOR, READ_UP_TO};
use crate::report::page::{Page, escaped, swatch};
use crate::report::{grouped, plain, significant, with_sigma};

/// What the curve says, for a student.
const GLOSSARY: [(&str, &str); 8] = [
    (
        "Allan deviation",
        "how much two neighbouring averages over τ differ, as rms over √2: how far an average over τ can be trusted to hold for the next one.",
    ),
    ("overlapping", "every pair of neighbouring averages, whichever row it begins at: surer than the plain one, and the same on average."),
    (
        "N",
        "white noise of the rate. Its integral walks: after one hour the angle is off by N. The one-sided density is √2 N; data sheets give either.",
    ),
    ("B", "flicker: the floor that no averaging gets under. The floor stands at 0.664 B; 0.664 is √(2 ln 2/π)."),
    ("K", "the rate itself walks at random: after one hour it is off by K."),
    ("R", "a steady drift of the rate, of temperature mostly."),
    ("Q", "steps or noise of the angle behind the rate."),
    ("T/10", "nothing is read from averages longer than a tenth of the record: fewer than ten of them are independent."),
];

fn title(answer: &Answer) -> String {
    let taken = if answer.take == Take::Integral { ", taken as the integral" } else { "" };
    format!(
        "{}: {}{taken}, {} rows, {} s at {} s",
        answer.log,
        answer.column,
        grouped(answer.rows),
        plain(answer.duration_s(), 6),
        plain(answer.interval_s, 6)
    )
}

fn name(answer: &Answer, process: &Process) -> &'static str {
    if answer.unit.rad.is_some() { process.name } else { process.plain_name }
}

fn value(answer: &Answer, coefficient: &Coefficient, process: &Process) -> String {
    let (scale, unit) = answer.shown(process);
    match (coefficient.value, coefficient.sigma) {
        (Some(value), Some(sigma)) => {
            let floor = if process.letter == "B" {
                format!("; the curve's floor is 0.664 B = {} {unit}", significant(FLOOR * value * scale, 3))
            } else {
                String::new()
            };
            format!("{} {unit}{floor}", with_sigma(value * scale, sigma * scale))
        }
        _ => coefficient.says.clone().unwrap_or_default(),
    }
}

/// √2 N in the units of data sheets.
fn density(answer: &Answer) -> Option<String> {
    let shown = std::f64::consts::SQRT_2 * answer.coefficients[WHITE].value?;
    let units = match answer.unit.rad {
        Some(rad) => vec![(rad.to_degrees() * 3600.0, "(°/h)/√Hz".to_owned()), (rad.to_degrees(), "(°/s)/√Hz".to_owned())],
        None => vec![(1.0, answer.unit.times("/√Hz"))],
    };
    let each: Vec<String> = units.iter().map(|(scale, unit)| format!("{} {unit}", significant(shown * scale, 4))).collect();
    Some(format!("one-sided density √2 N = {}", each.join(" = ")))
}

fn lowest(answer: &Answer) -> Option<String> {
    let found = answer.lowest.as_ref()?;
    let (scale, unit) = answer.shown_deviation();
    let low = format!("lowest point {} {unit} at {} s", significant(found.oadev * scale, 3), significant(found.tau_s, 3));
    Some(if found.inside {
        format!(
            "{low}, over 0.664: {} {unit} (bias instability as data sheets give it{})",
            with_sigma(found.over_floor * scale, found.sigma * scale),
            if answer.coefficients[FLICKER].value.is_some() { ", with what the others add there" } else { "" }
        )
    } else {
        let floor = if answer.coefficients[FLICKER].value.is_some() { "the curve still falls towards 0.664 B" } else { "no floor is seen" };
        format!("{low}, at the end of what is read: {floor}")
    })
}

fn read(answer: &Answer) -> Option<String> {
    let [from, to] = answer.read_s?;
    Some(format!(
        "coefficients read from τ = {} s to T/10 = {} s; χ² per degree of freedom {}",
        significant(from, 3),
        significant(to, 3),
        significant(answer.misfit?, 2)
    ))
}

fn quantum(answer: &Answer) -> Option<String> {
    let unit = crate::allan::units::Unit::of(&answer.column).name;
    answer.quantum.map(|quantum| format!("the column's least significant bit is {} {unit}", significant(quantum, 3)))
}

/// What stands below the coefficients.
fn remarks(answer: &Answer) -> Vec<String> {
    [lowest(answer), read(answer), quantum(answer)].into_iter().flatten().chain(answer.says.iter().cloned()).collect()
}

/// For a terminal.
pub fn text(answer: &Answer) -> String {
    let mut out = title(answer) + "\n";
    for (p, (coefficient, process)) in answer.coefficients.iter().zip(&PROCESSES).enumerate() {
        out += &format!("  {:<18} {}  {}\n", name(answer, process), process.letter, value(answer, coefficient, process));
        if let (WHITE, Some(density)) = (p, density(answer)) {
            out += &format!("  {:<21} {density}\n", "");
        }
    }
    for line in remarks(answer) {
        out += &line;
        out.push('\n');
    }
    let (scale, unit) = answer.shown_deviation();
    out +=
        &format!("\n{:>10}  {:>11}  {:>25}  {:>11}  {:>10}  {:>8}\n", "τ, s", format!("OADEV, {unit}"), "68 %", "ADEV", "terms", "degrees");
    for p in &answer.points {
        let number = |x: f64| significant(x * scale, 4);
        let between = format!("{} … {}", number(p.within_68[0]), number(p.within_68[1]));
        let beyond = if p.tau_s > READ_UP_TO * answer.duration_s() { "  beyond T/10" } else { "" };
        out += &format!(
            "{:>10}  {:>11}  {between:>25}  {:>11}  {:>10}  {:>8}{beyond}\n",
            significant(p.tau_s, 4),
            number(p.oadev),
            number(p.adev),
            grouped(p.terms),
            significant(p.degrees, 3)
        );
    }
    out
}

/// One HTML file.
pub fn html(answer: &Answer) -> String {
    let mut page = Page::new(&format!("allan {} {}", answer.log, answer.column));
    page.paragraph("lead", &title(answer));
    for line in &answer.says {
        page.paragraph("warn", line);
    }
    page.figure(
        &picture::curve(answer),
        &format!(
            "{} overlapping Allan deviation, {} its 95 % confidence, {} all processes together, {} each of them, {} beyond T/10",
            swatch("modelled", ""),
            swatch("band", ""),
            swatch("residual", ""),
            swatch("process", ""),
            swatch("held", "")
        ),
    );
    page.push("<section><h2>Coefficients</h2><div class=\"scroll\"><table><thead><tr><th></th><th></th><th>value</th><th>slope of σ(τ)</th></tr></thead><tbody>");
    for (p, (coefficient, process)) in answer.coefficients.iter().zip(&PROCESSES).enumerate() {
        let class = if coefficient.value.is_some() { "" } else { " class=\"faint\"" };
        let more = density(answer).filter(|_| p == WHITE).map(|d| format!("<br/>{}", escaped(&d))).unwrap_or_default();
        page.push(&format!(
            "<tr{class}><td>{}</td><td>{}</td><td>{}{more}</td><td>{}</td></tr>",
            name(answer, process),
            process.letter,
            escaped(&value(answer, coefficient, process)),
            process.slope
        ));
    }
    page.push("</tbody></table></div>");
    for line in [lowest(answer), read(answer), quantum(answer)].into_iter().flatten() {
        page.paragraph("", &line);
    }
    let (scale, unit) = answer.shown_deviation();
    page.push(&format!("</section><section><h2>Curve</h2><div class=\"scroll\"><table><thead><tr><th>τ, s</th><th>overlapping, {unit}</th><th>68 %</th><th>95 %</th><th>plain, {unit}</th><th>terms</th><th>degrees of freedom</th><th>strongest</th></tr></thead><tbody>"));
    for p in &answer.points {
        let number = |x: f64| significant(x * scale, 4);
        let between = |range: [f64; 2]| format!("{} … {}", number(range[0]), number(range[1]));
        let class = if p.tau_s > READ_UP_TO * answer.duration_s() { " class=\"faint\"" } else { "" };
        page.push(&format!(
            "<tr{class}><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td>{}</td></tr>",
            significant(p.tau_s, 4),
            number(p.oadev),
            between(p.within_68),
            between(p.within_95),
            number(p.adev),
            grouped(p.terms),
            significant(p.degrees, 3),
            PROCESSES[p.strongest].letter
        ));
    }
    page.push("</tbody></table></div></section><section><h2>Words</h2><dl>");
    for (word, says) in GLOSSARY {
        page.push(&format!("<dt>{word}</dt><dd>{}</dd>", escaped(says)));
    }
    page.push("</dl></section>");
    page.finish()
}
