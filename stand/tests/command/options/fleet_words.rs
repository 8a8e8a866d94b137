//! One check for each word of `fleet`, and for those of `explain` that make its table.

use std::path::Path;

use super::{Check, help_everywhere, json, json_in_both_places, page, stand};

pub const WORDS: [(&str, Check); 8] = [
    ("explain --table", |f| {
        table(f);
        assert!(std::fs::read(f.join("answers.parquet")).unwrap().starts_with(b"PAR1"));
    }),
    ("explain --stands", |f| {
        std::fs::write(f.join("stands.csv"), "path,stand,batch\nlogs/a.csv,A,7\n").unwrap();
        let batches = |more: &[&str]| {
            stand(f, &[&TABLE[..], more].concat()).succeeded();
            json(f, &["fleet", "report", "answers.parquet"])["batches"].clone()
        };
        std::fs::create_dir(f.join("logs")).unwrap();
        std::fs::copy(f.join("log.csv"), f.join("logs/a.csv")).unwrap();
        assert_eq!((batches(&[]), batches(&["--stands", "stands.csv"])), (0.into(), 1.into()));
    }),
    ("fleet", |f| {
        table(f);
        assert!(stand(f, &["fleet", "report", "answers.parquet"]).succeeded().out.contains("1 log of 1 stand"));
    }),
    ("fleet --help", help_everywhere),
    ("fleet report --help", help_everywhere),
    ("fleet report <TABLE>... --since", |f| {
        table(f);
        std::fs::copy(f.join("answers.parquet"), f.join("more.parquet")).unwrap();
        assert_eq!(json(f, &["fleet", "report", "answers.parquet", "more.parquet"])["logs"], 2);
        let before = |date: &str| json(f, &["fleet", "report", "answers.parquet", "--since", date])["logs_before"].clone();
        assert_eq!((before("2020-01-01"), before("2100-01-01")), (0.into(), 1.into()));
    }),
    ("fleet report --stands", |f| {
        table(f);
        std::fs::write(f.join("stands.csv"), "path,stand,batch\nlogs/a.csv,A,7\n").unwrap();
        assert_eq!(json(f, &["fleet", "report", "answers.parquet", "--stands", "stands.csv"])["batches"], 1);
    }),
    ("fleet report --json --html --plots", |f| {
        table(f);
        json_in_both_places(f, &["fleet", "report", "answers.parquet"]);
        page(f, &["fleet", "report", "answers.parquet"]);
    }),
];

const TABLE: [&str; 6] = ["explain", "logs", "--model", "model.toml", "--table", "answers.parquet"];

/// A table of one log.
fn table(folder: &Path) {
    std::fs::create_dir(folder.join("logs")).unwrap();
    std::fs::copy(folder.join("log.csv"), folder.join("logs/a.csv")).unwrap();
    stand(folder, &TABLE).succeeded();
}
