//! Motor controllers and microcontrollers: Arduino, ODrive, VESC Tool, SimpleFOC, Betaflight, moteus, PX4, ROS.

use super::{ForeignFile, ROWS, Rows, file};

const ALL: &[(&str, f64)] = &[("t_s", 1e-6), ("u_V", 1e-5), ("i_A", 1e-5), ("omega_rad_s", 1e-5), ("theta_rad", 1e-6)];

pub(super) fn files(r: &Rows) -> Vec<ForeignFile> {
    vec![
        arduino(r),
        ForeignFile {
            rows: (0, ROWS),
            ..file(
                "serial_plotter.txt",
                r.text("Setup done\n", |k| {
                    format!("t_ms:{:.0}\tu:{:.6}\ti:{:.6}\tomega_rad_s:{:.6}", 1e3 * r.t(k), r.u(k), r.i(k), r.omega(k))
                }),
                &["--unit", "t_ms=ms"],
                &[("t_s", 1e-6), ("u_V", 1e-5), ("i_A", 1e-5), ("omega_rad_s", 1e-5)],
            )
        },
        file(
            "serial_monitor.txt",
            r.text("", |k| {
                let ms = (1e3 * r.t(k)).round() as u64 + 200;
                format!("12:00:{:02}.{:03} -> {:.6},{:.6},{:.6}", ms / 1000, ms % 1000, r.u(k), r.i(k), r.rpm(k))
            }),
            &["--map", "2=u_V", "--map", "3=i_A", "--map", "4=omega_rad_s", "--unit", "4=rpm"],
            &[("u_V", 1e-5), ("i_A", 1e-5), ("omega_rad_s", 1e-5)],
        ),
        file(
            "odrive.csv",
            r.text("time,axis0.encoder.pos_estimate,axis0.encoder.vel_estimate,axis0.motor.current_control.Iq_measured,vq\n", |k| {
                format!("{:.6},{:.9},{:.9},{:.9},{:.9}", r.t(k), r.rev(k), r.omega(k) / std::f64::consts::TAU, r.i(k), r.u(k))
            }),
            &["--unit", "2=rev", "--unit", "3=rev/s", "--map", "vq=u_V", "--unit", "4=A", "--unit", "vq=V"],
            ALL,
        ),
        file(
            "vesc.csv",
            r.text("ms_today;input_voltage;temp_mos_max;temp_motor;current_motor;current_in;erpm;duty_cycle;fault\n", |k| {
                format!(
                    "{:.0};12.0;30.1;{:.2};{:.6};{:.6};{:.4};{:.7};FAULT_CODE_NONE",
                    4.32e7 + 1e3 * r.t(k),
                    r.temp(k),
                    r.i(k),
                    0.5 * r.i(k),
                    7.0 * r.rpm(k),
                    r.u(k) / 12.0
                )
            }),
            &["--map", "duty_cycle=u_V", "--unit", "duty_cycle=12 V", "--map", "erpm=omega_rad_s", "--unit", "erpm=0.142857142857 rpm"],
            &[("t_s", 1e-6), ("u_V", 1e-4), ("i_A", 1e-5), ("omega_rad_s", 1e-4)],
        ),
        file(
            "simplefoc.txt",
            r.text("MOT: Align sensor.\nMOT: Ready.\n", |k| format!("{:.6}\t{:.6}\t{:.6}\t{:.6}", r.u(k), 1e3 * r.i(k), r.omega(k), r.theta(k))),
            &["--sample-rate", "1000", "--map", "1=u_V", "--map", "2=i_A", "--unit", "2=mA", "--map", "3=omega_rad_s", "--map", "4=theta_rad"],
            ALL,
        ),
        file(
            "betaflight.csv",
            r.text("loopIteration, time (us), motor[0], gyroADC[2] (deg/s), vbatLatest (V), amperageLatest (A)\n", |k| {
                format!("{k}, {:.0}, {:.4}, {:.5}, {:.6}, {:.6}", 3.1e7 + 1e6 * r.t(k), 12.0, r.omega(k).to_degrees(), r.u(k), r.i(k))
            }),
            &["--map", "4=omega_rad_s", "--map", "5=u_V", "--map", "6=i_A"],
            &[("t_s", 1e-6), ("u_V", 1e-4), ("i_A", 1e-5), ("omega_rad_s", 1e-5)],
        ),
        file(
            "moteus.csv",
            r.text("timestamp,mode,position,velocity,torque,q_current,voltage\n", |k| {
                format!(
                    "{:.6},10,{:.9},{:.9},{:.9},{:.9},{:.9}",
                    1.7145576e9 + r.t(k),
                    r.rev(k),
                    r.omega(k) / std::f64::consts::TAU,
                    0.0234 * r.i(k),
                    r.i(k),
                    r.u(k)
                )
            }),
            &["--unit", "position=rev", "--unit", "velocity=rev/s", "--unit", "torque=N m"],
            &[("u_V", 1e-5), ("i_A", 1e-5), ("omega_rad_s", 1e-5), ("theta_rad", 1e-6)],
        ),
        file(
            "px4.csv",
            r.text("timestamp,timestamp_sample,voltage_v,current_a,indicated_frequency_rpm,xyz[0]\n", |k| {
                let us = 5_000_000 + (1e6 * r.t(k)).round() as u64;
                format!("{us},{},{:.6},{:.6},{:.5},0.1", us - 90, r.u(k), r.i(k), r.rpm(k))
            }),
            &[],
            &[("t_s", 1e-6), ("u_V", 1e-5), ("i_A", 1e-5), ("omega_rad_s", 1e-5)],
        ),
        file(
            "rostopic.csv",
            r.text("%time,field.header.seq,field.header.stamp,field.header.frame_id,field.name0,field.position0,field.velocity0,field.effort0\n", |k| {
                let ns = 1_714_557_600_000_000_000_u64 + (1e9 * r.t(k)).round() as u64;
                format!("{},{k},{ns},,wheel,{:.9},{:.9},{:.9}", ns + 70_000, r.theta(k), r.omega(k), 0.0234 * r.i(k))
            }),
            &["--unit", "field.position0=rad", "--unit", "field.velocity0=rad/s", "--map", "field.effort0=torque_N_m"],
            &[("theta_rad", 1e-6), ("omega_rad_s", 1e-5)],
        ),
    ]
}

/// A serial monitor: the lines of the boot, a first and a last line that are cut, no names.
fn arduino(r: &Rows) -> ForeignFile {
    let line = |k: usize| format!("{:.0},{:.6},{:.6},{:.0}", 1e3 * r.t(k), r.u(k), r.i(k), r.theta(k) / std::f64::consts::TAU * 20_000.0);
    let mut text = r.text(&format!("ets Jun  8 2016 00:22:57\n\nrst:0x1 (POWERON_RESET)\nready\n{}\n", &line(0)[4..]), line);
    text.truncate(text.len() - 9);
    let columns = &[("t_s", 1e-6), ("u_V", 1e-5), ("i_A", 1e-5), ("theta_rad", 1e-6)];
    let stated =
        &["--map", "1=t_s", "--unit", "1=ms", "--map", "2=u_V", "--map", "3=i_A", "--map", "4=theta_rad", "--unit", "4=counts:20000"];
    ForeignFile { rows: (0, ROWS - 1), said: "cut", ..file("arduino.txt", text, stated, columns) }
}
