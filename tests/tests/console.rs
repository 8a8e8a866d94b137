//! The whole controller behind its serial line: what a person and a program at it see.
#![allow(clippy::unwrap_used)]

use hal_sim::plant::Stand;
use stand_tests::bench::{at_the_bench, with_flash};
use stand_tests::rate_accuracy::cogging_stand;

#[test]
fn a_person_turns_the_platform_and_all_three_witnesses_agree() {
    at_the_bench(&cogging_stand(), async |host| {
        host.tell("SOUR:RATE 100 DEG/S;:SOUR:MODE RATE").await;
        host.wait_s(1.0).await;
        let asked = host.number("SOUR:RATE?").await;
        let measured = host.number("MEASure:RATE?").await;
        let rate = 100_f64.to_radians();
        assert!((asked - rate).abs() < 1e-6);
        // Cogging wobbles by some percent within a turn.
        assert!((measured / rate - 1.0).abs() < 0.05 && (host.true_rate_rad_s() / rate - 1.0).abs() < 0.05, "{measured}");
        assert_eq!(host.ask("OUTP?").await, "1");
        host.tell("OUTP OFF").await;
        assert_eq!(host.ask("OUTP?").await, "0");
        host.wait_s(5.0).await;
        assert!(host.true_rate_rad_s().abs() < 0.1, "it has run out");
    });
}

#[test]
fn every_bad_word_gets_one_clear_line_and_nothing_is_lost() {
    at_the_bench(&Stand::default(), async |host| {
        for (line, number, says) in [
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
            assert!(error.to_lowercase().contains(&says.to_lowercase()), "{line:.40}: {error}");
            assert!(error.len() < 140 && error.is_ascii(), "{line:.40}: {error}");
            assert_eq!(host.ask("SYST:ERR:COUN?").await, "0", "{line:.40}: one line and no more");
        }
        // What comes behind the bad word of another line is done all the same.
        host.send(b"NONSENSE\nSOUR:RATE 3\n");
        assert_eq!(host.number("SOUR:RATE?").await, 3.0);
    });
}

#[test]
fn every_command_of_the_help_can_be_asked_in_its_long_and_its_short_form() {
    at_the_bench(&Stand::default(), async |host| {
        let lines = host.list("HELP?").await;
        assert!(lines.len() > 80, "{}", lines.len());
        let mut asked = 0;
        for line in &lines {
            let header = line.split("  ").next().unwrap().split(" -> ").next().unwrap();
            let Some(question) = header.strip_suffix('?') else { continue };
            // Lists have more than one line; what waits or is taken away by asking is asked elsewhere.
            if question.ends_with("LIST") || ["HELP", "SYSTem:ERRor:ALL"].contains(&question) {
                continue;
            }
            let short: String = question.split(':').map(short_form).collect::<Vec<_>>().join(":");
            for form in [question, &short] {
                host.send(format!("{form}?\n").as_bytes());
                let answer = host.line(0.2).await;
                let error = host.ask("SYST:ERR?").await;
                // A reading that is not there yet says so; nothing is undefined.
                assert!(answer.is_some() == error.starts_with("0,"), "{form}?: {answer:?} {error}");
                assert!(!error.starts_with("-1"), "{form}?: {error}");
                asked += 1;
            }
        }
        println!("{asked} questions");
        assert!(asked > 100, "{asked}");
    });
}

/// The capitals of a word of a header; names of settings and parameters have one form.
fn short_form(word: &str) -> &str {
    let capitals = word.len() - word.trim_start_matches(|c: char| c.is_ascii_uppercase() || c == '*').len();
    if capitals > 1 && !word.contains('_') { &word[..capitals] } else { word }
}

#[test]
fn settings_are_kept_over_a_power_cut_where_they_were_saved_and_forgotten_where_not() {
    let stand = Stand::default();
    let ((), flash) = with_flash(&stand, hal_sim::controller::flash(1), async |host| {
        host.tell("SETTings:slip_rad 0.07").await;
        host.tell("SETTings:SAVE").await;
        host.tell("SETTings:slip_rad 0.09").await;
        assert_eq!(host.number("SETT:slip_rad?").await, 0.09);
    });
    let ((), flash) = with_flash(&stand, flash, async |host| {
        assert_eq!(host.number("SETT:slip_rad?").await, 0.07);
        // In the middle of its life, too.
        host.break_(hal_sim::faults::FaultKind::PowerCut, 0.2, None);
        host.wait_s(0.5).await;
        host.heard();
        assert_eq!((host.power_cuts(), host.number("SETT:slip_rad?").await), (1, 0.07));
        assert_eq!(host.ask("OUTP?").await, "0");
        host.tell("SETTings:RESet").await;
        assert_eq!(host.number("SETT:slip_rad?").await, Stand::default().firmware.slip_rad);
        assert!(host.refusal("SOUR:MODE RATE;:SETT:SAVE").await.starts_with("-221"), "not while it drives");
    });
    with_flash(&stand, flash, async |host| assert_eq!(host.number("SETT:slip_rad?").await, 0.07));
}

#[test]
fn a_profile_runs_to_its_end_and_opc_waits_for_it() {
    at_the_bench(&Stand::default(), async |host| {
        host.wait_s(0.1).await; // before the first row there is no angle
        host.tell("PROF:TYPE turns;:PROF:AMPL 10;:PROF:TURNS 2;:PROF:DUR 2").await;
        let begin = host.number("MEAS:ANGL?").await;
        host.tell("PROF:STAR").await;
        assert_eq!(host.ask("PROF:STAT?").await, "RUNNING");
        host.send(b"*OPC?\n");
        assert_eq!(host.line(5.0).await.as_deref(), Some("1"));
        assert_eq!(host.ask("PROF:STAT?").await, "STOPPED");
        let turned = host.number("MEAS:ANGL?").await - begin;
        assert!((turned - 2.0 * std::f64::consts::TAU).abs() < 0.01, "two whole turns: {turned}");
    });
}

#[test]
fn a_setting_that_is_set_is_in_force_with_the_next_start() {
    at_the_bench(&Stand::default(), async |host| {
        host.wait_s(0.1).await;
        host.tell("SETT:acceleration_rad_s2 2").await;
        host.tell("SOUR:RATE 10;MODE RATE").await;
        host.wait_s(1.0).await;
        let rate = host.true_rate_rad_s();
        assert!((rate - 2.0).abs() < 0.2, "a second at 2 rad/s²: {rate}");
        assert!(host.ask("FAULt:LIMits?").await.contains("acceleration"));
    });
}
