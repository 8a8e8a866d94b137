//! One check for each word of `allan`.

use std::path::Path;

use serde_json::Value;

use super::{Check, help_everywhere, json, json_in_both_places, page, stand};

pub const WORDS: [(&str, Check); 7] = [
    ("allan --help", help_everywhere),
    ("allan --units", |f| {
        still(f);
        let text = stand(f, &["allan", "still.csv", "--column", "gyro_rad_s", "--units", "deg/h"]).succeeded().out;
        assert!(text.contains("°/h") || text.contains("°/√h"), "{text}");
    }),
    ("allan <LOG> --column", |f| {
        still(f);
        let first = |log: &str, column: &str| allan(f, log, column, &[])["oadev"][0].as_f64().unwrap();
        let (gyro, volts) = (first("still.csv", "gyro_rad_s"), first("still.csv", "u_V"));
        assert!((volts / gyro - 3.0).abs() < 1e-9 && (first("louder.csv", "gyro_rad_s") / gyro - 2.0).abs() < 1e-9, "{gyro} {volts}");
    }),
    ("allan --from --to", |f| {
        still(f);
        let samples = |more: &[&str]| allan(f, "still.csv", "gyro_rad_s", more)["samples"].clone();
        // Rows at 0.00, 0.01 … 9.99 s.
        assert_eq!([samples(&[]), samples(&["--from", "4.005"]), samples(&["--to", "4.005"])], [1000, 599, 401].map(Value::from));
        assert_eq!(stand(f, &["allan", "still.csv", "--column", "u_V", "--from", "5", "--to", "4"]).status, Some(2));
    }),
    ("allan --taus", |f| {
        still(f);
        let rows = |taus: &str| {
            let answer = allan(f, "still.csv", "gyro_rad_s", &["--taus", taus]);
            let taus = answer["tau_s"].as_array().unwrap();
            taus.iter().map(|t| (t.as_f64().unwrap() / 0.01).round() as usize).collect::<Vec<_>>()
        };
        assert_eq!(rows("octave"), [1, 2, 4, 8, 16, 32, 64, 128, 256]);
        assert_eq!(rows("decade"), [1, 2, 5, 10, 20, 50, 100, 200, 500]);
        assert_eq!(rows("fine")[..12], [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]);
    }),
    ("allan --as", |f| {
        still(f);
        let unit = |column: &str, more: &[&str]| allan(f, "still.csv", column, more)["unit"].clone();
        assert_eq!((unit("theta_rad", &[]), unit("theta_rad", &["--as", "value"])), ("rad/s".into(), "rad".into()));
        assert_eq!((unit("u_V", &[]), unit("u_V", &["--as", "integral"])), ("V".into(), "V/s".into()));
    }),
    ("allan --json --html --plots", |f| {
        still(f);
        json_in_both_places(f, &["allan", "still.csv", "--column", "gyro_rad_s"]);
        page(f, &["allan", "still.csv", "--column", "gyro_rad_s"]);
    }),
];

fn allan(folder: &Path, log: &str, column: &str, more: &[&str]) -> Value {
    json(folder, &[&["allan", log, "--column", column], more].concat())
}

/// Ten seconds of pseudo-noise, and a copy with twice the amplitude.
fn still(folder: &Path) {
    for (name, loud) in [("still.csv", 1.0), ("louder.csv", 2.0)] {
        let mut text = "t_s,gyro_rad_s,u_V,theta_rad\n".to_owned();
        let mut state = 1_u64;
        for k in 0..1000 {
            state = state * 16_807 % 2_147_483_647;
            let noise = loud * (state as f64 / 2_147_483_647.0 - 0.5);
            text += &format!("{},{noise},{},{}\n", f64::from(k) / 100.0, 3.0 * noise, 0.1 * noise);
        }
        std::fs::write(folder.join(name), text).unwrap();
    }
}
