use super::*;
use drive_model::{Abscissa, Coordinate, Output};

/// Noise of the default stand at 1 kHz in the unit of the output.
fn noise(output: Output) -> f64 {
    match output {
        Output::Current => 2.7e-3,
        // The noise of the current times the resistance.
        Output::Voltage => 6e-3,
        Output::Rate | Output::EncoderRate => 8e-3,
    }
}

fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64
}

/// Fraction of the mean square that the means of 100 bins explain.
fn explained_fraction(over: &[f64], values: &[f64]) -> f64 {
    let range = over.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |r, v| (r.0.min(*v), r.1.max(*v)));
    let mut bins = vec![(0.0, 0.0); 100];
    for (x, v) in over.iter().zip(values) {
        let bin = &mut bins[((x - range.0) / (range.1 - range.0) * 99.99) as usize];
        *bin = (bin.0 + v, bin.1 + 1.0);
    }
    let explained: f64 = bins.iter().filter(|b| b.1 > 0.0).map(|b| b.0 * b.0 / b.1).sum();
    explained / values.len() as f64 / mean_square(values)
}

/// Checks every effect, in parallel; the failures.
fn check_all(check: impl Fn(&'static Card) -> Option<String> + Sync) -> Vec<String> {
    std::thread::scope(|scope| {
        let check = &check;
        let runs: Vec<_> = cards().iter().map(|card| scope.spawn(move || check(card))).collect();
        runs.into_iter().filter_map(|run| run.join().unwrap()).collect()
    })
}

#[test]
fn every_effect_is_visible_in_its_plot() {
    let invisible = check_all(|card| {
        let pair = simulated_pair(card).unwrap();
        let size = mean_square(&pair.difference()).sqrt() / noise(pair.demonstration.output);
        (size.is_nan() || size < 3.0).then(|| format!("{}: {size:.2} × the noise", card.id))
    });
    assert!(invisible.is_empty(), "{invisible:?}");
}

#[test]
fn difference_is_a_function_of_its_coordinate() {
    let poor = check_all(|card| {
        let pair = simulated_pair(card).unwrap();
        // After a reversal the difference has the sign of the reversal.
        if pair.demonstration.abscissa == Abscissa::Coordinate(Coordinate::History) {
            return None;
        }
        let fraction = explained_fraction(&pair.with.abscissa, &pair.difference());
        (fraction.is_nan() || fraction < 0.9).then(|| format!("{}: {fraction:.2}", card.id))
    });
    assert!(poor.is_empty(), "{poor:?}");
}

#[test]
fn pages_are_well_formed_and_self_contained() {
    let wrong = check_all(|card| {
        let page = effect_html(card);
        let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
        let drawings = roxmltree::Document::parse_with_options(&page, options)
            .map(|d| d.descendants().filter(|n| n.has_tag_name("svg")).count())
            .unwrap_or(0);
        let fetches = ["http", "src=", "href=", "NaN"].iter().any(|f| page.contains(f));
        (drawings != 2 || fetches || page.len() > 300_000).then(|| format!("{}: {drawings} drawings, {} bytes", card.id, page.len()))
    });
    assert!(wrong.is_empty(), "{wrong:?}");
    assert!(list_html().contains("cogging") && !list_html().contains("http"));
}

#[test]
fn terminal_page() {
    insta::assert_snapshot!(effect_text(drive_model::card("cogging").unwrap(), false));
}

#[test]
fn list_names_every_effect_within_eighty_columns() {
    let text = list_text(false);
    assert!(cards().iter().all(|c| text.contains(c.id)));
    for page in cards().iter().map(|c| effect_text(c, false)).chain([text]) {
        for line in page.lines() {
            assert!(line.chars().count() <= 80, "{line}");
        }
    }
}

#[test]
fn json_has_the_card() {
    let answer = effect_json(drive_model::card("rate-scale").unwrap());
    assert_eq!(answer["coordinate"], "omega");
    assert_eq!(answer["parameters"][0]["name"], "rate_scale");
    assert_eq!(list_json()["effects"].as_array().map(Vec::len), Some(cards().len()));
}
