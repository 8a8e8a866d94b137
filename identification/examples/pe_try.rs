use identification::identify::explain::{Criteria, Engine, explain_by};
use identification::log::Log;
use identification::model::Model;
fn main() {
    for folder in std::env::args().skip(1) {
        let log = Log::read(format!("{folder}/log.parquet")).unwrap();
        let model = Model::read(format!("{folder}/model.toml")).unwrap();
        let mut criteria = Criteria::default();
        if std::env::var("OLD").is_ok() { criteria.search.engine = Engine::Whitened; }
        match explain_by(criteria, vec![log], &model, &|_| ()) {
            Ok(e) => {
                println!("{folder}: {} {:?} ({:.1} s)", e.verdict.name(), e.missing, e.seconds);
                for s in &e.stages {
                    println!("    +{:?} {:?}", s.added, s.outputs.iter().map(|o| format!("{:.3}/{:.3}", o.ratio(), o.heldout_rms.unwrap_or(0.0)/o.noise)).collect::<Vec<_>>());
                }
                for c in e.candidates.iter().filter(|c| c.refitted).take(5) {
                    println!("      {} {:.0} {:?} amb {:?} out {:?} {}", c.effect, c.delta_bic.unwrap_or(0.0), c.refused, c.ambiguous_with, c.outputs.iter().map(|o| format!("{:.2}", o.ratio())).collect::<Vec<_>>(), c.parameters.iter().map(|p| format!("{}={:.4e}±{:.1e}", p.name, p.value, p.sigma)).collect::<Vec<_>>().join(" "));
                }
                for r in &e.remarks { println!("    remark {r:?}"); }
                for s in &e.unexplained { println!("    shape {:?} over {:?} {:.0} {:?} {:?}", s.acts_on, s.coordinate, s.delta_bic, s.form, s.expression); }
                if std::env::var("PAR").is_ok() {
                    let f = &e.explained;
                    println!("   PAR {}", f.parameters.list.iter().zip(&f.sigmas).map(|(p, s)| format!("{}={:.8e}±{:.2e}", p.name, p.value, s)).collect::<Vec<_>>().join(" "));
                }
            }
            Err(e) => println!("{folder}: ERROR {e}"),
        }
    }
}
