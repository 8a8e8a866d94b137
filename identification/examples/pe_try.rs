use identification::log::Log;
use identification::model::Model;
fn main() {
    for folder in std::env::args().skip(1) {
        let log = Log::read(format!("{folder}/log.parquet")).unwrap();
        let model = Model::read(format!("{folder}/model.toml")).unwrap();
        identification::identify::explain::prediction_error::explore::explore(&log, &model, &folder);
    }
}
