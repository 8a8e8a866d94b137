//! Are effects found whose amplitude is the detection limit that `explain` states?
//!
//! `cargo bench -p stand-tests --bench detection -- [N] [SEED] [DIRT]`: N logs in which nothing is hidden, each adequate, with an imperfection of a bench
//! (`confusion -- dirt`; default none); then each log again with one effect planted at its limit, the effects in turn. Aim: found in 95 %.

use std::collections::BTreeMap;
use std::process::ExitCode;

use host_tools::identify::explain::{Candidate, Explanation, Verdict, explain};
use rayon::prelude::*;
use stand_tests::dirt::Dirt;
use stand_tests::draw::{Drawn, PROFILES};
use stand_tests::verdicts::same_family;

/// What became of a planted effect.
#[derive(Default)]
struct Found {
    planted: usize,
    named: usize,
    other: usize,
    missed: Vec<String>,
}

fn answer(drawn: &Drawn, dirt: Dirt) -> Option<Explanation> {
    explain(vec![dirt.on(&drawn.log(), drawn.seed())], &drawn.user_model(), &|_| {}).ok()
}

fn main() -> ExitCode {
    let numbers: Vec<u64> = std::env::args().skip(1).filter_map(|w| w.parse().ok()).collect();
    let (count, first) = (numbers.first().copied().unwrap_or(60), numbers.get(1).copied().unwrap_or(7001));
    let named = std::env::args().skip(1).find(|w| !w.starts_with('-') && w.parse::<u64>().is_err());
    let Some(dirt) = named.as_deref().map_or(Some(Dirt::Clean), Dirt::by_name) else {
        eprintln!("detection [N] [SEED] [DIRT]: DIRT is one of {}", Dirt::ALL.map(Dirt::name).join(", "));
        return ExitCode::from(2);
    };
    let results: Vec<(String, String, bool, bool)> = (0..count)
        .into_par_iter()
        .filter_map(|k| {
            let mode = if k % 2 == 0 { "voltage" } else { "rate" };
            let drawn = Drawn::by_name(&format!("nulls/{mode}/{}/{}", PROFILES[(k / 2) as usize % PROFILES.len()], first + k))?;
            let null = answer(&drawn, dirt)?;
            let limits = &null.detection_limits;
            let limit = limits.get(k as usize * 7 % limits.len().max(1))?;
            let planted = answer(&drawn.clone().with_effect_at(limit, 1.0), dirt)?;
            let effect = limit.card.id;
            let first_candidate = planted.candidates.iter().find(|c| planted.missing.first() == Some(&c.effect));
            let alike = first_candidate.is_some_and(|c| c.ambiguous_with.iter().any(|name| same_family(name, effect)));
            let named = planted.missing.iter().any(|name| same_family(name, effect)) || alike;
            eprintln!("{}: {effect} {:.3e} {:?}: {:?} {:?}", drawn.id, limit.size, limit.at, planted.verdict, planted.missing);
            if !named {
                // Why: the planted effect and what was named, as candidates.
                let of_interest = |c: &&Candidate| planted.missing.contains(&c.effect) || same_family(&c.effect, effect);
                for c in planted.candidates.iter().filter(of_interest) {
                    eprintln!(
                        "    {}: ΔBIC {:?}, p 1e{:.1}, like {:?}, {:?}",
                        c.effect, c.delta_bic, c.log10_p, c.ambiguous_with, c.refused
                    );
                }
            }
            Some((drawn.id.clone(), effect.to_owned(), named, planted.verdict != Verdict::Adequate))
        })
        .collect();
    let mut by_effect: BTreeMap<&str, Found> = BTreeMap::new();
    for (id, effect, named, noticed) in &results {
        let found = by_effect.entry(effect).or_default();
        found.planted += 1;
        found.named += usize::from(*named);
        found.other += usize::from(!named && *noticed);
        if !named && !noticed {
            found.missed.push(id.clone());
        }
    }
    println!(
        "| effect at its limit | logs | named, or not distinguishable | another answer than adequate | missed |\n|---|---|---|---|---|"
    );
    for (effect, f) in &by_effect {
        println!("| `{effect}` | {} | {} | {} | {} |", f.planted, f.named, f.other, f.missed.join(", "));
    }
    let sum = |of: fn(&Found) -> usize| by_effect.values().map(of).sum::<usize>();
    println!("| all | {} | {} | {} | {} |", sum(|f| f.planted), sum(|f| f.named), sum(|f| f.other), sum(|f| f.missed.len()));
    ExitCode::SUCCESS
}
