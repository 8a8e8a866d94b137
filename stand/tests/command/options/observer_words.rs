//! One check for each word of `observer` and `vibration`.

use std::path::Path;

use serde_json::Value;

use super::served::{Served, send_lines as console};
use super::{Check, Log, help_everywhere, json, json_in_both_places, page, stand, stdout_of};

pub const WORDS: [(&str, Check); 28] = [
    ("observer --help", help_everywhere),
    ("observer design --help", help_everywhere),
    ("observer simulate --help", help_everywhere),
    ("observer bode --help", help_everywhere),
    ("vibration --help", help_everywhere),
    ("vibration compensate --help", help_everywhere),
    ("observer design [MODEL] --preset --omega --poles", |f| {
        let usual = gains(f, &["rate-observer"]);
        assert_eq!(usual, gains(f, &["--preset", "rate-observer"]));
        assert_ne!(usual, gains(f, &["astatic-identifier"]));
        assert_ne!(usual, gains(f, &["rate-observer", "--omega", "200"]));
        assert_eq!(usual, gains(f, &["rate-observer", "--poles", "-100,-100,-100,-100"]));
    }),
    ("observer design --kind --row --integral-gain", |f| {
        let channel = |more: &[&str]| design(f, &[&["astatic-identifier"], more].concat())["integral"].clone();
        assert_eq!(channel(&["--kind", "static"]), Value::Null);
        assert_eq!((&channel(&["--row", "3"])["row"], &channel(&["--integral-gain", "3e5"])["gain"]), (&3.into(), &3e5.into()));
        assert_ne!(channel(&["--kind", "augmented"]), channel(&[]));
    }),
    ("observer design --step --vibration-hz", |f| {
        assert_eq!(design(f, &["rate-observer", "--step", "2e-3"])["discrete"]["step_s"], 2e-3);
        let warned = |f: &Path, hz: &str| design(f, &["rate-observer", "--vibration-hz", hz])["warnings"].to_string().contains("vibration");
        assert!(warned(f, "20") && !warned(f, "1"));
    }),
    ("observer design --json", |f| json_in_both_places(f, &["observer", "design", "rate-observer"])),
    ("observer design --html --plots", |f| page(f, &["observer", "design", "rate-observer"])),
    #[cfg(unix)]
    ("observer design --port --save --torquer --regulator", |f| {
        let one = Served::new(f, &["--flash", "flash.bin"]);
        let words = ["observer", "design", "astatic-identifier-recovered", "--kind", "augmented", "--port", &one.port];
        stand(f, &[&words[..], &["--torquer", "0.07", "--regulator", "0.01,0.065", "--save"]].concat()).succeeded();
        console(f, &one.port, "SETTings:LOAD\n").succeeded();
        let list = console(f, &one.port, "OBServer:LIST?\n").succeeded().out;
        for line in ["states 7", "moment 1", "torquer_N_m_A 0.07", "regulator 0.01 0.065 0 0 0 0 1", "gain 0.0148887706 -297.332429"] {
            assert!(list.contains(line), "{line}: {list}");
        }
    }),
    ("observer simulate [MODEL] --preset --omega --poles --kind --row --integral-gain --vibration-hz", |f| {
        let usual = simulated(f, &["astatic-identifier"]);
        assert_eq!(usual, simulated(f, &["--preset", "astatic-identifier", "--vibration-hz", "5"]), "of the warnings of a design");
        for more in [
            &["--omega", "60"][..],
            &["--poles", "-50,-50,-50,-50,-50,-51"],
            &["--kind", "augmented"],
            &["--row", "3"],
            &["--integral-gain", "1e5"],
        ] {
            assert_ne!(usual, simulated(f, &[&["astatic-identifier"], more].concat()), "{more:?}");
        }
    }),
    ("observer simulate --angle --moment --seconds --step --regulator-angle --regulator-rate --loop-seconds", |f| {
        let usual = simulated(f, &["astatic-identifier"]);
        for more in [["--angle", "2e-2"], ["--moment", "3e-5"], ["--seconds", "2"], ["--step", "2e-3"], ["--regulator-angle", "0.02"]] {
            assert_ne!(usual, simulated(f, &[&["astatic-identifier"], &more[..]].concat()), "{more:?}");
        }
        // The rate's gain changes the static loop's final value, and both change the picture.
        assert_ne!(usual, simulated(f, &["astatic-identifier", "--regulator-rate", "0.1"]));
        let picture = |seconds: &str| {
            stdout_of(f, &["observer", "simulate", "astatic-identifier", "--loop-seconds", seconds, "--html", "s.html"]);
            std::fs::read_to_string(f.join("s.html")).unwrap()
        };
        assert_ne!(picture("20"), picture("40"));
    }),
    ("observer simulate --moment-harmonic --moment-random --seed", |f| {
        let usual = simulated(f, &["astatic-identifier"]);
        let random = ["astatic-identifier", "--moment-random", "1e-5,0.1"];
        assert_ne!(usual, simulated(f, &["astatic-identifier", "--moment-harmonic", "1e-5,3"]));
        assert_ne!(usual, simulated(f, &random));
        assert_ne!(simulated(f, &random), simulated(f, &[&random[..], &["--seed", "2"]].concat()));
    }),
    ("observer simulate --json --html --plots", |f| {
        json_in_both_places(f, &["observer", "simulate", "astatic-identifier"]);
        page(f, &["observer", "simulate", "astatic-identifier"]);
    }),
    ("observer bode [MODEL] --preset --omega --kind --row --vibration-hz", |f| {
        let bode = |words: &[&str]| json(f, &[&["observer", "bode"], words].concat());
        let usual = bode(&["astatic-identifier"]);
        assert_eq!(usual, bode(&["--preset", "astatic-identifier"]));
        assert_eq!(bode(&["astatic-identifier", "--omega", "7"])["observers"][0]["omega_rad_s"], 7.0);
        assert_ne!(bode(&["astatic-identifier", "--omega", "50", "--kind", "augmented"]), bode(&["astatic-identifier", "--omega", "50"]));
        let row = |row: &str| bode(&["astatic-identifier", "--omega", "50", "--kind", "integral", "--row", row]);
        assert_ne!(row("2"), row("3"));
        assert!(bode(&["rate-observer", "--vibration-hz", "5"])["observers"][0]["at_vibration"].is_object());
    }),
    ("observer bode --json --html --plots", |f| {
        json_in_both_places(f, &["observer", "bode", "rate-observer"]);
        page(f, &["observer", "bode", "rate-observer"]);
    }),
    ("vibration compensate --gamma-gain-error --gamma-delay-error --gamma-misalignment --gamma-offset --element-error", |f| {
        swinging(f);
        let budget = |more: &[&str]| json(f, &[&["vibration", "compensate", "swing.csv"], more].concat())["azimuth_rad"]["budget"].clone();
        let usual = budget(&[]);
        for option in ["--gamma-gain-error", "--gamma-delay-error", "--gamma-misalignment", "--gamma-offset", "--element-error"] {
            assert_ne!(usual, budget(&[option, "7"]), "{option}");
        }
    }),
    ("vibration compensate <LOG> --model --omega --vibration-hz --angle-gain --json --html --plots", |f| {
        swinging(f);
        let answer = |more: &[&str]| json(f, &[&["vibration", "compensate", "swing.csv"], more].concat());
        let usual = answer(&[]);
        for more in [["--omega", "200"], ["--vibration-hz", "4"], ["--angle-gain", "40"], ["--model", "other.toml"]] {
            assert_ne!(usual, answer(&more), "{more:?}");
        }
        json_in_both_places(f, &["vibration", "compensate", "swing.csv"]);
        page(f, &["vibration", "compensate", "swing.csv"]);
    }),
    ("observer track --help", help_everywhere),
    ("observer simulate --out --force", |f| {
        let write =
            |more: &[&str]| stand(f, &[&["observer", "simulate", "astatic-identifier-recovered", "--out", "free.csv"][..], more].concat());
        write(&["--force"]).succeeded();
        assert!(write(&[]).status == Some(2) && std::fs::read_to_string(f.join("free.csv")).unwrap().contains("moment_N_m"));
    }),
    ("observer track <LOG> --model --omega --poles --kind --row --integral-gain --vibration-hz", |f| {
        free(f);
        let usual = tracked(f, &[]);
        assert_eq!(usual, tracked(f, &["--vibration-hz", "5"]), "of the warnings of a design");
        for more in [
            &["--omega", "60"][..],
            &["--poles", "-50,-50,-50,-50,-50,-50,-51"],
            &["--kind", "static"],
            &["--kind", "integral"],
            &["--model", "astatic-identifier"],
        ] {
            assert_ne!(usual, tracked(f, more), "{more:?}");
        }
        let integral = |more: &[&str]| tracked(f, &[&["--kind", "integral"], more].concat());
        assert_ne!(integral(&["--row", "3"]), integral(&[]));
        assert_ne!(integral(&["--integral-gain", "1e5"]), integral(&[]));
    }),
    ("observer track --angle-gain --torquer", |f| {
        free(f);
        assert_ne!(tracked(f, &[]), tracked(f, &["--angle-gain", "40"]));
        assert!(stand(f, &["observer", "track", "free.csv", "--torquer", "1"]).err.contains("torquer_A"));
    }),
    ("observer track --out --force", |f| {
        free(f);
        let write = |more: &[&str]| stand(f, &[&["observer", "track", "free.csv", "--out", "hat.csv"][..], more].concat());
        write(&["--force"]).succeeded();
        assert!(write(&[]).status == Some(2) && std::fs::read_to_string(f.join("hat.csv")).unwrap().contains("hat_moment_N_m"));
    }),
    ("observer track --json", |f| {
        free(f);
        json_in_both_places(f, &["observer", "track", "free.csv"]);
    }),
    ("sim --vibration", |f| {
        let log = |vibration: &str| {
            stand(f, &["sim", "--gyro", "--vibration", vibration, "--seconds", "1", "--out", "v.csv", "--force"]).succeeded();
            std::fs::read_to_string(f.join("v.csv")).unwrap()
        };
        let usual = log("1e-3,2");
        assert_eq!(usual, log("1e-3,2,45,0"));
        assert!(["2e-3,2", "1e-3,3", "1e-3,2,30", "1e-3,2,45,60"].iter().all(|other| log(other) != usual));
    }),
    #[cfg(unix)]
    ("record --also", |f| {
        let one = Served::new(f, &[]);
        stand(
            f,
            &[
                "record",
                "--port",
                &one.port,
                "--out",
                "r.csv",
                "--force",
                "--seconds",
                "0.2",
                "--decimation",
                "2",
                "--also",
                "age_s,from_index_rad",
            ],
        )
        .succeeded();
        assert!(Log::read(f.join("r.csv")).is_ok());
        let refused = stand(f, &["record", "--port", &one.port, "--out", "r.csv", "--force", "--also", "nonesuch"]);
        assert!(refused.status == Some(2) && refused.err.contains("nonesuch"), "{}", refused.err);
    }),
];

fn design(folder: &Path, words: &[&str]) -> Value {
    json(folder, &[&["observer", "design"], words].concat())
}

fn gains(folder: &Path, words: &[&str]) -> Value {
    design(folder, words)["gains"].clone()
}

fn simulated(folder: &Path, words: &[&str]) -> Value {
    json(folder, &[&["observer", "simulate"], words].concat())
}

/// An azimuth and a roll that oscillate at 5 Hz, and another element.
fn swinging(folder: &Path) {
    let mut text = "# angle_gain_V_rad: 20\nt_s,angle_sensor_V,gamma_rad\n".to_owned();
    for k in 0..4000 {
        let t_s = f64::from(k) * 1e-3;
        let phase = std::f64::consts::TAU * 5.0 * t_s;
        text += &format!("{t_s},{},{}\n", 20.0 * (1e-3 + 1e-3 * phase.sin()), 1e-3 * phase.cos());
    }
    std::fs::write(folder.join("swing.csv"), text).unwrap();
    let element = "[four_state]\nrotor_N_m_s = 0.3\ninertia_x_kg_m2 = 0.01\ninertia_y_kg_m2 = 8e-3\ninertia_z_kg_m2 = 0.02\npendulum_N_m = 1.0\n\
                   link_damping_N_m_s = 2.4e-3\nalpha_damping_N_m_s = 0.0\nbeta_damping_N_m_s = 1e-3\ngamma_damping_N_m_s = 2e-3\n\
                   link_rad_s = 0.0\nlatitude_deg = 40.0\n";
    std::fs::write(folder.join("other.toml"), element).unwrap();
}

/// A log of the free element.
fn free(folder: &Path) {
    stand(folder, &["observer", "simulate", "astatic-identifier-recovered", "--seconds", "30", "--out", "free.csv", "--force"]).succeeded();
}

fn tracked(folder: &Path, more: &[&str]) -> Value {
    json(folder, &[&["observer", "track", "free.csv"], more].concat())
}
