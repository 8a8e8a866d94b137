//! One check for each word of `records`.

use super::calibrate_words::run;
use super::calibration::SHORT;
use super::{Check, help_everywhere, json, json_in_both_places, page, stand, stdout_of};

pub const WORDS: [(&str, Check); 11] = [
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
];
