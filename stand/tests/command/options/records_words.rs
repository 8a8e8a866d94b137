//! One check for each word of `records`.

use super::calibrate_words::run;
use super::calibration::SHORT;
use super::{Check, help_everywhere, json, json_in_both_places, page, stand, stdout_of};

pub const WORDS: [(&str, Check); 23] = [
    ("records", |f| assert_eq!(stand(f, &["records"]).status, Some(2))),
    ("records --help", help_everywhere),
    ("records list --help", help_everywhere),
    ("records list <FOLDER>", |f| {
        run(f, "a/b", SHORT, &[]);
        std::fs::create_dir(f.join("c")).unwrap();
        assert!(stdout_of(f, &["records", "list", "a"]).contains("S-1") && stdout_of(f, &["records", "list", "c"]).contains("no records"));
    }),
    ("records list --json", |f| {
        run(f, "a", SHORT, &[]);
        json_in_both_places(f, &["records", "list", "."]);
    }),
    ("records show --help", help_everywhere),
    ("records show <RECORD> --json", |f| {
        let [one, two] = [("a", "1"), ("b", "2")].map(|(name, seed)| run(f, name, SHORT, &["--seed", seed])["scale"]["value"].clone());
        assert_eq!(
            (
                json(f, &["records", "show", "a"])["scale"]["value"].clone(),
                json(f, &["records", "show", "b/record.json"])["scale"]["value"].clone()
            ),
            (one, two)
        );
        json_in_both_places(f, &["records", "show", "a"]);
    }),
    ("records trend --help", help_everywhere),
    ("records trend <FOLDER> --serial --quantity", |f| {
        run(f, "k/a", SHORT, &[]);
        run(f, "k/b", SHORT, &["--serial", "S-2"]);
        run(f, "k/c", SHORT, &["--serial", "S-2"]);
        let records =
            |folder: &str, serial: &str| json(f, &["records", "trend", folder, "--serial", serial])["records"].as_array().unwrap().len();
        assert_eq!([records("k", "S-1"), records("k", "S-2"), records("k/b", "S-2")], [1, 2, 1]);
        let all = stdout_of(f, &["records", "trend", "k", "--serial", "S-2"]);
        let one = stdout_of(f, &["records", "trend", "k", "--serial", "S-2", "--quantity", "scale"]);
        assert!(all.contains("\nbias_rad_s\n") && !one.contains("\nbias_rad_s\n") && one.contains("\nscale\n"), "{one}");
    }),
    ("records trend --what", |f| {
        run(f, "a", SHORT, &[]);
        let of = |what: &str| stand(f, &["records", "trend", "a", "--serial", "S-1", "--what", what]).status;
        assert_eq!([of("gyro"), of("accel"), of("drive")], [Some(0), Some(2), Some(2)]);
    }),
    ("records trend --json --html --plots", |f| {
        run(f, "a", SHORT, &[]);
        run(f, "b", SHORT, &["--seed", "2"]);
        json_in_both_places(f, &["records", "trend", ".", "--serial", "S-1"]);
        page(f, &["records", "trend", ".", "--serial", "S-1"]);
    }),
    ("records add --help", help_everywhere),
    ("records evaluate --help", help_everywhere),
    ("records export --help", help_everywhere),
    ("certificate --help", help_everywhere),
    ("records add <STORE> <SESSIONS>... --json", |f| {
        run(f, "a", SHORT, &[]);
        run(f, "b", SHORT, &["--seed", "2"]);
        assert!(stdout_of(f, &["records", "add", "store", "a", "b"]).contains("session 2 of store"));
        json_in_both_places(f, &["records", "add", "store", "a"]);
    }),
    ("records show --session --units", |f| {
        run(f, "a", SHORT, &[]);
        stdout_of(f, &["records", "add", "store", "a"]);
        let shown = stdout_of(f, &["records", "show", "store", "--session", "1", "--units", "deg/h"]);
        assert!(shown.contains("°/h"), "{shown}");
    }),
    ("records evaluate <RECORD> --session --rate --reading --units --json", |f| {
        run(f, "a", SHORT, &[]);
        stdout_of(f, &["records", "add", "store", "a"]);
        json_in_both_places(f, &["records", "evaluate", "store", "--session", "1", "--rate", "-1,1"]);
        let text = stdout_of(f, &["records", "evaluate", "a", "--reading", "1", "--units", "deg/s"]);
        assert!(text.contains("°/s"), "{text}");
    }),
    ("records export <STORE> --out --force --json", |f| {
        run(f, "a", SHORT, &[]);
        stdout_of(f, &["records", "add", "store", "a"]);
        stdout_of(f, &["records", "export", "store", "--out", "all.csv"]);
        assert_eq!(stand(f, &["records", "export", "store", "--out", "all.csv"]).status, Some(2));
        stdout_of(f, &["records", "export", "store", "--out", "all.csv", "--force"]);
        json(f, &["records", "export", "store", "--out", "other.csv"]);
    }),
    ("certificate", |f| assert_eq!(stand(f, &["certificate"]).status, Some(2))),
    ("certificate [RECORD] --details --write-details --html --dcc --force --json", |f| {
        run(f, "g", SHORT, &[]);
        stdout_of(f, &["certificate", "--write-details", "details.toml"]);
        assert_eq!(stand(f, &["certificate", "--write-details", "details.toml"]).status, Some(2));
        stdout_of(f, &["certificate", "--write-details", "details.toml", "--force"]);
        stdout_of(f, &["certificate", "g", "--details", "details.toml", "--html", "c.html", "--dcc", "c.xml"]);
        for name in ["c.html", "c.xml"] {
            assert!(std::fs::read_to_string(f.join(name)).unwrap().contains("not issued under an accreditation"), "{name}");
        }
        json(f, &["certificate", "g", "--details", "details.toml", "--html", "other.html"]);
    }),
    ("calibrate --store --units", |f| {
        run(f, "a", SHORT, &["--store", "store"]);
        assert!(stdout_of(f, &["records", "list", "store"]).contains("S-1"));
        let text = stdout_of(f, &["calibrate", "gyro", "--from", "a", "--units", "deg/h"]);
        assert!(text.contains("°/h"), "{text}");
    }),
    ("calibrate --steps --known", |f| {
        // The staircase of a rate table, a hundred readings a second.
        let (mut log, mut table) = ("t_s,gyro_rad_s\n".to_owned(), "file,from,to,rate_deg_s\n".to_owned());
        for (step, rate_deg_s) in [0.0_f64, 20.0, 40.0, 60.0, 80.0, 0.0, -20.0, -40.0, -60.0, -80.0].into_iter().enumerate() {
            for k in 0..2000 {
                let t_s = 20.0 * step as f64 + 0.01 * f64::from(k);
                log += &format!("{t_s:.2},{}\n", rate_deg_s.to_radians() + 0.01 + 1e-3 * f64::from(k % 3));
            }
            table += &format!("up.csv,{},{},{rate_deg_s}\n", 20 * step + 5, 20 * step + 20);
        }
        std::fs::write(f.join("up.csv"), log).unwrap();
        std::fs::write(f.join("steps.csv"), table).unwrap();
        std::fs::write(f.join("known.toml"), "serial = \"F-1\"\nsettle_s = 1.0\n").unwrap();
        let text = stdout_of(f, &["calibrate", "gyro", "--from", ".", "--steps", "steps.csv", "--known", "known.toml"]);
        assert!(text.contains("F-1"), "{text}");
    }),
];
