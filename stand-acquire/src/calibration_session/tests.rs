use super::check::StandLimits;
use super::*;
use identification::deadline::Deadline;

#[test]
fn default_sessions_are_valid() {
    for what in [DutKind::Gyro, DutKind::Accel, DutKind::Drive] {
        let session = Session::parse(default_session(what)).unwrap_or_else(|e| panic!("{}: {e}", what.name()));
        assert_eq!(session.dut_kind, what);
        let stand = StandLimits { overspeed_rad_s: 45.0, acceleration_rad_s2: 60.0, voltage_V: 11.4, has_dut: true };
        check(&session, &stand).unwrap_or_else(|e| panic!("{}: {e}", what.name()));
        assert!(session.seconds() > 60.0 && session.seconds() < 600.0);
    }
}

fn refused(steps: &str) -> String {
    Session::parse(&format!("what = \"gyro\"\n{steps}")).unwrap_err().to_string()
}

#[test]
fn errors_name_step_and_parameter() {
    assert!(refused("").contains("steps"));
    assert!(refused("steps = []").contains("the session has none"));
    let step = |more: &str| format!("[[steps]]\nname = \"a\"\nseconds = 5.0\nmode = \"rate\"\n{more}");
    assert!(refused(&step("")).contains("step 1 `a`: profile: is missing"));
    assert!(refused(&step("profile = \"stare\"")).contains("profile"));
    assert!(refused(&step("profile = \"sine\"\nlevels = 3")).contains("levels: not a parameter of the profile sine"));
    assert!(refused(&step("profile = \"sine\"\nfrequency_hz = 3")).contains("did you mean frequency_Hz?"));
    assert!(refused(&step("profile = \"sine\"\namplitude = \"big\"")).contains("not a number"));
    assert!(refused(&step("profile = \"sine\"").replace("5.0", "0.0")).contains("seconds: 0 is outside"));
    let waits = |what: &str, seconds: &str, slope: &str| {
        let text = format!("what = \"{what}\"\n[[steps]]\nname = \"a\"\nmode = \"off\"\nseconds = {seconds}\nstable_K_min = {slope}\n");
        Session::parse(&text).map(|_| ()).map_err(|e| e.to_string())
    };
    assert_eq!((waits("gyro", "90.0", "0.2"), waits("drive", "90.0", "0.2")), (Ok(()), Ok(())));
    assert!(
        waits("gyro", "60.0", "0.2").unwrap_err().contains("step 1 `a`: stable_K_min: 0.2 must be above 0, in a step of more than 60 s")
    );
    assert!(waits("gyro", "90.0", "-1.0").unwrap_err().contains("stable_K_min: -1 must be above 0"));
    assert!(waits("accel", "90.0", "0.2").unwrap_err().contains("the logs of this session have no temperature"));
    let twice = format!("{0}{0}", step("profile = \"sine\"\n"));
    assert!(refused(&twice).contains("step 2 `a`: another step has this name"));
    assert!(Session::parse("what = \"gyro\"\nsteps = 3").is_err());
    assert!(Session::parse("what = \"moon\"\n").unwrap_err().to_string().contains("moon"));
}

#[test]
fn limits_of_the_stand_are_refused_with_their_values() {
    let stand = StandLimits { overspeed_rad_s: 45.0, acceleration_rad_s2: 60.0, voltage_V: 11.4, has_dut: true };
    let refused = |text: &str, stand: &StandLimits| check(&Session::parse(text).unwrap(), stand).unwrap_err().to_string();
    let step = |mode: &str, more: &str| format!("what = \"gyro\"\n[[steps]]\nname = \"a\"\nseconds = 5.0\nmode = \"{mode}\"\n{more}");
    assert!(refused(&step("rate", "profile = \"constant\"\namplitude = 44.0"), &stand).contains("95 % of the overspeed limit"));
    assert!(refused(&step("voltage", "profile = \"constant\"\namplitude = 12.0"), &stand).contains("11.4 V"));
    assert!(refused(&step("rate", "profile = \"sine\"\namplitude = 2.0\nfrequency_Hz = 50.0"), &stand).contains("628 rad/s²"));
    let limited =
        step("rate", "profile = \"constant\"\namplitude = 20.0").replace("[[steps]]", "limits = { rate_rad_s = 10.0 }\n[[steps]]");
    assert!(refused(&limited, &stand).contains("the session's limit of 10 rad/s"));
    let blind = StandLimits { has_dut: false, ..stand };
    assert!(refused(&step("rate", "profile = \"constant\"\namplitude = 2.0"), &blind).contains("no running device under test"));
}

#[test]
fn log_of_a_step_has_its_number_and_name() {
    let session = Session::parse(default_session(DutKind::Gyro)).unwrap();
    assert_eq!(session.steps[3].file(4), "04-turns-p.parquet");
    assert_eq!(session.steps[4].file(5), "05-turns-m.parquet");
}

#[test]
fn deadline_ends_a_session_before_anything_is_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let prepared = PreparedSession::new(None, DutKind::Drive, SessionChanges::default()).unwrap();
    let passed = Deadline::after_s(Some(0.0));
    let ended = simulated::simulate(&simulated::stand_with_dut(None, 1, &prepared.session), 1, &prepared, folder.path(), passed, |_| true);
    assert_eq!(ended.unwrap_err().to_string(), "interrupted by the user");
    assert!(std::fs::read_dir(folder.path()).unwrap().all(|file| !file.unwrap().file_name().to_string_lossy().contains("parquet")));
}

#[test]
fn instruction_leads_from_one_mounting_to_the_next() {
    let plan = |text: &str| {
        Session::parse(default_session(DutKind::Drive))
            .map(|session| StepPlan { instruction: (!text.is_empty()).then(|| text.to_owned()), ..session.steps[0].clone() })
            .unwrap()
    };
    let flat = Mounting::default();
    let side = Mounting { orientation: Orientation::Side, radius_m: 0.1, ..flat };
    let before = |text: &str, current, next| Instruction::before(&plan(text), current, next);
    assert!(before("", (flat, 0.0), (flat, 0.0)).is_empty());
    let both = before("", (flat, 0.0), (side, 2e-4));
    assert_eq!(
        both.to_string(),
        "Mount the device at a radius of 0.1 m, turned by 0°, on its side, its y along the platform's axis; tilt the stand by 0°. Put an inertia of 0.0002 kg m² on the platform, centred on its axis."
    );
    assert_eq!(before("", (flat, 2e-4), (flat, 0.0)).0, [Action::RemoveInertia]);
    assert_eq!(before("Turn the part over.", (flat, 0.0), (side, 0.0)).to_string(), "Turn the part over.");
}
