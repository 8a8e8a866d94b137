//! Exploration.
use std::time::Instant;

use super::search;
use crate::identify::explain::Context;
use crate::identify::explain::criteria::Criteria;
use crate::identify::fit;
use crate::log::Log;
use crate::model::Model;

pub fn explore(log: &Log, model: &Model, name: &str) {
    let criteria = Criteria::default();
    let t0 = Instant::now();
    let (data, _) = fit::prepare::prepare(log, model, true).unwrap();
    let rows = 0..data.len();
    let context = Context { log, log_rows: std::slice::from_ref(&rows), criteria: &criteria };
    let Some(given) = search::given(context, model, &data) else {
        println!("{name}: no fit");
        return;
    };
    let (d0, l0) = (given.model.prediction.noise.torque_density, given.model.prediction.minus_2_ln_likelihood);
    let fit_s = t0.elapsed().as_secs_f64();
    if std::env::var("PE_TIME").is_ok() {
        use crate::identify::predict::fit::Prediction;
        let p = Prediction::new(&given.model.fitted.system, &given.model.fitted.data);
        let f = given.model.prediction.clone();
        let t = Instant::now();
        for _ in 0..20 {
            let _ = p.at(&f.parameters, Some(f.initial_states.clone()), f.noise.clone());
        }
        println!("at {:.2} ms", t.elapsed().as_secs_f64() * 50.0);
        let t = Instant::now();
        for _ in 0..20 {
            let _ = fit::Iterate::new(p.system, &f.parameters, &p.following(&f.predictor), &f.initial_states);
        }
        println!("linearize {:.2} ms, {} + {} unknowns", t.elapsed().as_secs_f64() * 50.0, f.parameters.free().len(), f.initial_states.kinds.len());
        let t = Instant::now();
        let s = super::screen::Screening::of(&given.model);
        println!("screening {:.2} ms, {} trials, {} finite", t.elapsed().as_secs_f64() * 1e3, s.trials.len(), s.trials.iter().filter(|t| !t.trial.absent).count());
        for c in s.best(6) {
            let t = Instant::now();
            let c1 = super::candidate::Candidate::at_density_of(&given.model, c, 0.0);
            let t1 = t.elapsed().as_secs_f64() * 1e3;
            let Some(c1) = c1 else { println!("  {} failed {t1:.0} ms", c.trial.card.id); continue };
            let d = c1.delta_bic;
            let c2 = c1.with_own_noise(&given.model);
            println!("  {} predicted {:.0} at density {d:.0} {t1:.0} ms, own noise {:.0} {:.0} ms", c.trial.card.id, c.delta_bic, c2.delta_bic, t.elapsed().as_secs_f64() * 1e3 - t1);
        }
    }
    let (beam, first) = search::search(given);
    println!("{name}: given density {d0:.1e} -2lnL {l0:.0}; fit {fit_s:.2} s, all {:.2} s", t0.elapsed().as_secs_f64());
    for node in &beam {
        println!(
            "   {:?} {:.0} density {:.1e} noise {:?} {:?}",
            node.added,
            node.delta_bic,
            node.model.prediction.noise.torque_density,
            node.model.prediction.noise.channels.iter().map(|c| format!("{:.3e}", c.white)).collect::<Vec<_>>(),
            node.model.fitted.fit.channels.iter().map(|c| format!("{:.3}", c.rms / c.noise)).collect::<Vec<_>>()
        );
    }
    if let Some(node) = beam.first() {
        let f = &node.model.fitted.fit;
        let list: Vec<String> = f.parameters.list.iter().zip(&f.sigmas).map(|(p, s)| format!("{}={:.8e}±{:.2e}", p.name, p.value, s)).collect();
        println!("   PAR {}", list.join(" "));
    }
    for c in first.iter().take(6) {
        println!(
            "      {} {:.0} density {:.1e} {:?}",
            c.trial.card.id,
            c.delta_bic,
            c.prediction.noise.torque_density,
            c.own_parameters().iter().enumerate().map(|(k, p)| format!("{:.4e}±{:.1e}", p.value, c.sigmas.get(c.own.start + k).copied().unwrap_or(0.0))).collect::<Vec<_>>()
        );
    }
}
