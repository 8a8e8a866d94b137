//! The complete controller behind its serial line, as seen by an operator and by a program.
#![allow(clippy::unwrap_used)]

use hal_sim::plant::Stand;
use stand_tests::bench::{with_flash, with_stand};
use stand_tests::rate_accuracy::cogging_stand;

#[test]
fn commanded_measured_and_true_rate_agree() {
    with_stand(&cogging_stand(), async |host| {
        host.command("SOUR:RATE 100 DEG/S;:SOUR:MODE RATE").await;
        host.wait_s(1.0).await;
        let asked = host.number("SOUR:RATE?").await;
        let measured = host.number("MEASure:RATE?").await;
        let rate = 100_f64.to_radians();
        assert!((asked - rate).abs() < 1e-6);
        // Cogging modulates the rate by some percent within a turn.
        assert!((measured / rate - 1.0).abs() < 0.05 && (host.true_rate_rad_s() / rate - 1.0).abs() < 0.05, "{measured}");
        assert_eq!(host.query("OUTP?").await, "1");
        host.command("OUTP OFF").await;
        assert_eq!(host.query("OUTP?").await, "0");
        host.wait_s(5.0).await;
        assert!(host.true_rate_rad_s().abs() < 0.1, "the platform has coasted down");
    });
}

#[test]
fn every_bad_word_gets_one_clear_error_line() {
    with_stand(&Stand::default(), async |host| {
        for (line, number, expected) in [
            ("SOUR:RAET 1", "-113", "SOUR:RAET"),
            ("NONSENSE?", "-113", "NONSENSE"),
            ("SOUR:RATE", "-109", ""),
            ("SOUR:RATE fast", "-", ""),
            ("SOUR:RATE 1 KG", "-131", "KG"),
            ("SOUR:RATE 1,2", "-108", ""),
            ("SOUR:RATE 99999", "-222", ""),
            ("SOUR:MODE SIDEWAYS", "-224", "SIDEWAYS"),
            ("PROF:TYPE square", "-224", "square"),
            ("SETT:SLIP_RAD -3", "", ""),
            ("SOUR:RATE 1 RAD/S~00000000", "-362", ""),
            (&"X".repeat(300), "-223", "200 bytes"),
        ] {
            let error = host.refusal(line).await;
            println!("{line:.40}: {error}");
            assert!(error.starts_with(number) && !error.starts_with("0,"), "{line:.40}: {error}");
            assert!(error.to_lowercase().contains(&expected.to_lowercase()), "{line:.40}: {error}");
            assert!(error.len() < 140 && error.is_ascii(), "{line:.40}: {error}");
            assert_eq!(host.query("SYST:ERR:COUN?").await, "0", "{line:.40}: exactly one error");
        }
        // Commands of later lines are executed after a bad word.
        host.send(b"NONSENSE\nSOUR:RATE 3\n");
        assert_eq!(host.number("SOUR:RATE?").await, 3.0);
    });
}

#[test]
fn every_query_of_the_help_works_in_long_and_short_form() {
    with_stand(&Stand::default(), async |host| {
        let lines = host.list("HELP?").await;
        assert!(lines.len() > 80, "{}", lines.len());
        let mut asked = 0;
        for line in &lines {
            let header = line.split("  ").next().unwrap().split(" -> ").next().unwrap();
            let Some(query) = header.strip_suffix('?') else { continue };
            // Lists have several lines; queries that wait or remove entries are tested elsewhere.
            if query.ends_with("LIST") || ["HELP", "*LRN", "SYSTem:ERRor:ALL"].contains(&query) {
                continue;
            }
            let short: String = query.split(':').map(short_form).collect::<Vec<_>>().join(":");
            for form in [query, &short] {
                host.send(format!("{form}?\n").as_bytes());
                let answer = host.line(0.2).await;
                let error = host.query("SYST:ERR?").await;
                // A reading that is not yet available gives an error; no header is undefined.
                assert!(answer.is_some() == error.starts_with("0,"), "{form}?: {answer:?} {error}");
                assert!(!error.starts_with("-1"), "{form}?: {error}");
                asked += 1;
            }
        }
        println!("{asked} questions");
        assert!(asked > 100, "{asked}");
    });
}

/// The capitals of a header's word; names of settings and parameters have one form.
fn short_form(word: &str) -> &str {
    let capitals = word.len() - word.trim_start_matches(|c: char| c.is_ascii_uppercase() || c == '*').len();
    if capitals > 1 && !word.contains('_') { &word[..capitals] } else { word }
}

#[test]
fn saved_settings_survive_a_power_cut_and_unsaved_do_not() {
    let stand = Stand::default();
    let ((), flash) = with_flash(&stand, hal_sim::controller::flash(1), async |host| {
        host.command("SETTings:slip_rad 0.07").await;
        host.command("SETTings:SAVE").await;
        host.command("SETTings:slip_rad 0.09").await;
        assert_eq!(host.number("SETT:slip_rad?").await, 0.09);
    });
    let ((), flash) = with_flash(&stand, flash, async |host| {
        assert_eq!(host.number("SETT:slip_rad?").await, 0.07);
        // Also with a cut while running.
        host.inject_fault(hal_sim::faults::FaultKind::PowerCut, 0.2, None);
        host.wait_s(0.5).await;
        host.received();
        assert_eq!((host.power_cuts(), host.number("SETT:slip_rad?").await), (1, 0.07));
        assert_eq!(host.query("OUTP?").await, "0");
        host.command("SETTings:RESet").await;
        assert_eq!(host.number("SETT:slip_rad?").await, Stand::default().firmware.slip_rad);
        assert!(host.refusal("SOUR:MODE RATE;:SETT:SAVE").await.starts_with("-221"), "refused while driving");
    });
    with_flash(&stand, flash, async |host| assert_eq!(host.number("SETT:slip_rad?").await, 0.07));
}

#[test]
fn opc_waits_for_the_end_of_a_profile() {
    with_stand(&Stand::default(), async |host| {
        host.wait_s(0.1).await; // before the first row there is no angle
        host.command("PROF:TYPE turns;:PROF:AMPL 10;:PROF:TURNS 2;:PROF:DUR 2").await;
        let begin = host.number("MEAS:ANGL?").await;
        host.command("PROF:STAR").await;
        assert_eq!(host.query("PROF:STAT?").await, "RUNNING");
        host.send(b"*OPC?\n");
        assert_eq!(host.line(5.0).await.as_deref(), Some("1"));
        assert_eq!(host.query("PROF:STAT?").await, "STOPPED");
        let turned = host.number("MEAS:ANGL?").await - begin;
        assert!((turned - 2.0 * std::f64::consts::TAU).abs() < 0.01, "two whole turns: {turned}");
    });
}

#[test]
fn setting_is_in_force_at_the_next_start() {
    with_stand(&Stand::default(), async |host| {
        host.wait_s(0.1).await;
        host.command("SETT:acceleration_rad_s2 2").await;
        host.command("SOUR:RATE 10;MODE RATE").await;
        host.wait_s(1.0).await;
        let rate = host.true_rate_rad_s();
        assert!((rate - 2.0).abs() < 0.2, "a second at 2 rad/s²: {rate}");
        assert!(host.query("FAULt:LIMits?").await.contains("acceleration"));
    });
}

/// Whether lists of commands are equal, numbers to the rounding of both decimal conversions.
fn are_same(a: &[String], b: &[String]) -> bool {
    let words =
        |lines: &[String]| lines.iter().flat_map(|line| line.split([' ', ',']).map(str::to_owned).collect::<Vec<_>>()).collect::<Vec<_>>();
    let (a, b) = (words(a), words(b));
    let is_same = |a: &String, b: &String| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => (a - b).abs() <= 1e-14 * a.abs(),
        _ => a == b,
    };
    a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| is_same(a, b))
}

/// IEEE 488.2 §10.17: the reply to `*LRN?`, sent to any stand, gives it the settings of the first.
#[test]
fn the_learnt_commands_restore_the_settings_on_another_stand() {
    let learnt = with_stand(&Stand::default(), async |host| {
        for command in [
            "SETTings:slip_rad 0.07;current_limit_A 0.9",
            "SETTings:motor_constant_N_m_A 0.05;:COMPensation:COULomb 0.04",
            "COMPensation:HARMonic 7,1E-4,-0.3",
            "OBServer:NEW 2,ON",
            "OBServer:PHI 2,-0.333333333333333315,0.97",
            "OBServer:GAIN 0.1,0.3",
        ] {
            host.command(command).await;
        }
        host.list("*LRN?").await
    });
    assert!(learnt.contains(&"COMPensation:HARMonic 7,0.0001 N.M,-0.3 RAD".to_owned()), "{learnt:?}");
    assert!(learnt.iter().any(|line| line.starts_with("OBServer:PHI 2,-0.333333333333333")), "{learnt:?}");
    with_stand(&Stand::default(), async |host| {
        // Settings from which single numbers of the list could not be set in any order.
        host.command("SETTings:supply_nominal_V 11.5;current_limit_A 0.01").await;
        assert!(!are_same(&host.list("*LRN?").await, &learnt));
        for command in &learnt {
            host.command(command).await;
        }
        let restored = host.list("*LRN?").await;
        assert!(are_same(&restored, &learnt), "{restored:?} {learnt:?}");
        host.command("OBServer:CLEar").await;
        assert_eq!(host.list("*LRN?").await.last().map(String::as_str), Some("OBServer:CLEar"));
    });
}
