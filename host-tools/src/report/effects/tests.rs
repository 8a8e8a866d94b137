use super::experiment::Shown;
use super::*;
use drive_model::Coordinate;

/// What the default stand's sensors scatter in these channels at 1 kHz: a difference below it could not be seen.
fn noise(shown: Shown) -> f64 {
    match shown {
        Shown::Current => 2.7e-3,
        // That of the current through the winding.
        Shown::Voltage => 6e-3,
        Shown::Rate | Shown::EncoderRate => 8e-3,
    }
}

fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64
}

/// Share of the mean square that the means of 100 bins account for.
fn share(over: &[f64], values: &[f64]) -> f64 {
    let range = over.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |r, v| (r.0.min(*v), r.1.max(*v)));
    let mut bins = vec![(0.0, 0.0); 100];
    for (x, v) in over.iter().zip(values) {
        let bin = &mut bins[((x - range.0) / (range.1 - range.0) * 99.99) as usize];
        *bin = (bin.0 + v, bin.1 + 1.0);
    }
    let explained: f64 = bins.iter().filter(|b| b.1 > 0.0).map(|b| b.0 * b.0 / b.1).sum();
    explained / values.len() as f64 / mean_square(values)
}

/// Asks the same of every effect, side by side; what is wrong with each.
fn of_all(ask: impl Fn(&'static Card) -> Option<String> + Sync) -> Vec<String> {
    std::thread::scope(|scope| {
        let ask = &ask;
        let runs: Vec<_> = CATALOGUE.iter().map(|card| scope.spawn(move || ask(card))).collect();
        runs.into_iter().filter_map(|run| run.join().unwrap()).collect()
    })
}

#[test]
fn every_effect_of_the_catalogue_is_seen_in_its_picture() {
    let flat = of_all(|card| {
        let beside = beside(card).unwrap();
        let size = mean_square(&beside.difference()).sqrt() / noise(beside.experiment.shown);
        (size.is_nan() || size < 3.0).then(|| format!("{}: {size:.2} × the noise", card.id))
    });
    assert!(flat.is_empty(), "{flat:?}");
}

#[test]
fn the_difference_follows_the_coordinate_it_is_drawn_over() {
    let loose = of_all(|card| {
        let beside = beside(card).unwrap();
        // After a reversal it has the sign of the reversal.
        if beside.experiment.over == Over::Coordinate(Coordinate::History) {
            return None;
        }
        let share = share(&beside.with.over, &beside.difference());
        (share.is_nan() || share < 0.9).then(|| format!("{}: {share:.2}", card.id))
    });
    assert!(loose.is_empty(), "{loose:?}");
}

#[test]
fn every_page_is_one_well_formed_file_that_fetches_nothing() {
    let wrong = of_all(|card| {
        let page = effect_html(card);
        let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
        let drawings = roxmltree::Document::parse_with_options(&page, options)
            .map(|d| d.descendants().filter(|n| n.has_tag_name("svg")).count())
            .unwrap_or(0);
        let fetches = ["http", "src=", "href=", "<script", "NaN"].iter().any(|f| page.contains(f));
        (drawings != 2 || fetches || page.len() > 300_000).then(|| format!("{}: {drawings} drawings, {} bytes", card.id, page.len()))
    });
    assert!(wrong.is_empty(), "{wrong:?}");
    assert!(list_html().contains("cogging") && !list_html().contains("http"));
}

#[test]
fn the_terminal_page_reads_well() {
    insta::assert_snapshot!(effect_text(drive_model::card("cogging").unwrap(), false));
}

#[test]
fn the_list_names_every_effect_within_eighty_columns() {
    let text = list_text(false);
    assert!(CATALOGUE.iter().all(|c| text.contains(c.id)));
    for page in CATALOGUE.iter().map(|c| effect_text(c, false)).chain([text]) {
        for line in page.lines() {
            assert!(line.chars().count() <= 80, "{line}");
        }
    }
}

#[test]
fn the_answer_has_the_card() {
    let answer = effect_json(drive_model::card("rate-scale").unwrap());
    assert_eq!(answer["coordinate"], "omega");
    assert_eq!(answer["parameters"][0]["name"], "rate_scale");
    assert_eq!(list_json()["effects"].as_array().map(Vec::len), Some(CATALOGUE.len()));
}
