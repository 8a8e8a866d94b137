//! Scientific software: pandas, R, Octave, MATLAB, gnuplot.

use super::{ForeignFile, ROWS, Rows, file};

const ALL: &[(&str, f64)] = &[("t_s", 1e-6), ("u_V", 1e-5), ("i_A", 1e-5), ("omega_rad_s", 1e-5), ("theta_rad", 1e-6)];

pub(super) fn files(r: &Rows) -> Vec<ForeignFile> {
    let cells = |k: usize, sep: &str| [r.t(k), r.u(k), r.i(k), r.omega(k), r.theta(k)].map(|v| format!("{v:.9}")).join(sep);
    let si = &["--unit", "omega=rad/s", "--unit", "theta=rad"];
    vec![
        file(
            "pandas_index.csv",
            r.text(",t,u,i,omega,theta,armed\n", |k| format!("{k},{},{}", cells(k, ","), if k % 7 < 3 { "True" } else { "False" })),
            si,
            ALL,
        ),
        file(
            "pandas_stamps.csv",
            r.text("timestamp,u_V,i_A,omega_rad_s\n", |k| {
                let us = (1e6 * r.t(k)).round() as u64;
                format!("2024-05-01 12:00:{:02}.{:06}+02:00,{:.7},{:.7},{:.7}", us / 1_000_000, us % 1_000_000, r.u(k), r.i(k), r.omega(k))
            }),
            &[],
            &[("u_V", 1e-5), ("i_A", 1e-5), ("omega_rad_s", 1e-5)],
        ),
        ForeignFile { said: "no number", ..pandas_nan(r) },
        file(
            "r_write_csv.csv",
            r.text("\"\",\"t\",\"u\",\"i\",\"omega\",\"theta\"\n", |k| format!("\"{}\",{}", k + 1, cells(k, ","))),
            si,
            ALL,
        ),
        file(
            "r_write_table.txt",
            r.text("\"t\" \"u\" \"i\" \"omega\" \"theta\"\n", |k| format!("\"{}\" {}", k + 1, cells(k, " "))),
            si,
            ALL,
        ),
        octave_matrices(r),
        file(
            "octave_ascii.dat",
            r.text("", |k| format!(" {}", [r.t(k), r.u(k), r.i(k), r.omega(k), r.theta(k)].map(|v| format!("{v:.8e}")).join(" "))),
            &["--map", "2=u_V", "--map", "3=i_A", "--map", "4=omega_rad_s", "--map", "5=theta_rad"],
            ALL,
        ),
        file(
            "matlab_writematrix.csv",
            r.text("", |k| cells(k, ",")),
            &["--map", "2=u_V", "--map", "3=i_A", "--map", "4=omega_rad_s", "--map", "5=theta_rad"],
            ALL,
        ),
        file("matlab_writetable.csv", r.text("Time_s,Voltage_V,Current_A,Speed_rad_s,Angle_rad\n", |k| cells(k, ",")), &[], ALL),
        file("gnuplot.dat", r.text("# t[s] u[V] i[A] omega[rad/s] theta[rad]\n", |k| cells(k, "  ")), &[], ALL),
    ]
}

/// Empty cells as a merge of two loggers leaves them.
fn pandas_nan(r: &Rows) -> ForeignFile {
    let text = r.text("t_s,u_V,i_mA,speed_rpm\n", |k| {
        let i = if (1000..1010).contains(&k) { String::new() } else { format!("{:.5}", 1e3 * r.i(k)) };
        format!("{:.6},{:.7},{i},{:.6}", r.t(k), r.u(k), r.rpm(k))
    });
    ForeignFile { rows: (0, 1000), ..file("pandas_nan.csv", text, &[], &[("u_V", 1e-5), ("i_A", 1e-5), ("omega_rad_s", 1e-5)]) }
}

/// `save -text` of five vectors.
fn octave_matrices(r: &Rows) -> ForeignFile {
    let mut text = "# Created by Octave 8.4.0, Wed May 01 12:00:00 2024 CEST <lab@bench>\n".to_owned();
    let vectors: [(&str, &dyn Fn(usize) -> f64); 5] =
        [("t", &|k| r.t(k)), ("u", &|k| r.u(k)), ("i", &|k| r.i(k)), ("omega", &|k| r.omega(k)), ("theta", &|k| r.theta(k))];
    for (name, value) in vectors {
        text += &format!("# name: {name}\n# type: matrix\n# rows: {ROWS}\n# columns: 1\n");
        text += &r.text("", |k| format!(" {:.10}", value(k)));
        text += "\n\n";
    }
    text += "# name: n\n# type: scalar\n3000\n\n\n";
    file("octave_text.txt", text, &["--unit", "omega=rad/s", "--unit", "theta=rad"], ALL)
}
