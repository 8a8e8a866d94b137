//! One check for each word of `stability`.

use std::path::Path;

use super::{Check, help_everywhere, json, json_in_both_places, page, stand};

pub const WORDS: [(&str, Check); 4] = [
    ("stability --help", help_everywhere),
    ("stability <LOG> --settle", |f| {
        turning(f);
        let start = |more: &[&str]| {
            let answer = json(f, &[&["stability", "turning.csv"], more].concat());
            answer["plateaus"][0]["start_s"].as_f64().unwrap()
        };
        assert_eq!((start(&[]), start(&["--settle", "3"])), (1.0, 3.0));
    }),
    ("stability --limit --units", |f| {
        turning(f);
        let within = |ppm: &str| json(f, &["stability", "turning.csv", "--limit", ppm])["plateaus"][0]["widths"][0]["within_limit"].clone();
        assert_eq!((within("1e6"), within("1e-3")), ("yes".into(), "no".into()));
        let text = stand(f, &["stability", "turning.csv", "--units", "deg/s"]).succeeded().out;
        assert!(text.contains("°/s"), "{text}");
    }),
    ("stability --json --html --plots", |f| {
        turning(f);
        json_in_both_places(f, &["stability", "turning.csv"]);
        page(f, &["stability", "turning.csv"]);
    }),
];

/// 20 s at 2 rad/s with a ripple of four periods per turn, 100 rows per second.
fn turning(folder: &Path) {
    let mut text = "t_s,theta_rad,rate_cmd_rad_s\n".to_owned();
    for k in 0..2000 {
        let t_s = f64::from(k) / 100.0;
        let theta = 2.0 * t_s + 2e-3 * (8.0 * t_s).sin();
        text += &format!("{t_s},{theta},2\n");
    }
    std::fs::write(folder.join("turning.csv"), text).unwrap();
}
