//! Spreadsheets and hand-made tables in several languages.

use super::{ForeignFile, ROWS, Rows, comma, file};

const ALL: &[(&str, f64)] = &[("t_s", 1e-6), ("u_V", 1e-5), ("i_A", 1e-5), ("omega_rad_s", 1e-5), ("theta_rad", 1e-5)];

/// A number in the German form, with points between thousands.
fn german(value: f64, digits: usize) -> String {
    grouped(value, digits, ".")
}

fn grouped(value: f64, digits: usize, mark: &str) -> String {
    let text = format!("{:.digits$}", value.abs());
    let (whole, fraction) = text.split_once('.').unwrap_or((&text, ""));
    let mut out = String::new();
    for (k, digit) in whole.chars().enumerate() {
        if k > 0 && (whole.len() - k) % 3 == 0 {
            out.push_str(mark);
        }
        out.push(digit);
    }
    let sign = if value < 0.0 { "-" } else { "" };
    if fraction.is_empty() { format!("{sign}{out}") } else { format!("{sign}{out},{fraction}") }
}

pub(super) fn files(r: &Rows) -> Vec<ForeignFile> {
    let ukrainian = r.text("Час, мс;Напруга, В;Струм, мА;Швидкість, об/хв;Кут, град\r\n", |k| {
        comma(format!("{:.3};{:.7};{:.5};{:.6};{:.6}\r", 1e3 * r.t(k), r.u(k), 1e3 * r.i(k), r.rpm(k), r.deg(k)))
    });
    vec![
        file(
            "excel_de.csv",
            r.text("\u{feff}\"Zeit [ms]\";\"Spannung [V]\";\"Strom [mA]\";\"Drehzahl [U/min]\";\"Winkel [°]\";\r\n", |k| {
                format!(
                    "\"{}\";\"{}\";\"{}\";\"{}\";\"{}\";\r",
                    german(1e3 * r.t(k), 3),
                    german(r.u(k), 7),
                    german(1e3 * r.i(k), 5),
                    german(r.rpm(k), 6),
                    german(r.deg(k), 6)
                )
            }),
            &[],
            ALL,
        ),
        file(
            "excel_fr.csv",
            r.text("Temps;Tension;Courant;Vitesse;Angle\r\nms;V;mA;tr/min;deg\r\n", |k| {
                let n = |v: f64, d| grouped(v, d, "\u{202f}");
                format!("{};{};{};{};{}\r", n(1e3 * r.t(k), 3), n(r.u(k), 7), n(1e3 * r.i(k), 5), n(r.rpm(k), 6), n(r.deg(k), 6))
            }),
            &[],
            ALL,
        ),
        file(
            "excel_us_thousands.csv",
            r.text("Time (ms),Voltage (V),Current (mA),Speed (rpm),Angle (deg)\r\n", |k| {
                let n = |v: f64, d| grouped(v, d, "#").replace(',', ".").replace('#', ",");
                format!("\"{}\",{:.7},{:.5},{:.6},\"{}\"\r", n(1e3 * r.t(k), 3), r.u(k), 1e3 * r.i(k), r.rpm(k), n(r.deg(k), 6))
            }),
            &[],
            ALL,
        ),
        file("excel_ua.csv", ukrainian.clone(), &[], ALL),
        file("excel_ua_1251.csv", windows_1251(&ukrainian), &[], ALL),
        file(
            "excel_de_latin1.csv",
            r.text("Zeit [ms];Spannung [V];Strom [mA];Drehzahl [1/min];Winkel [°]\r\n", |k| {
                comma(format!("{:.3};{:.7};{:.5};{:.6};{:.6}\r", 1e3 * r.t(k), r.u(k), 1e3 * r.i(k), r.rpm(k), r.deg(k)))
            })
            .chars()
            .map(|c| if c == '°' { 0xb0 } else { c as u8 })
            .collect::<Vec<u8>>(),
            &[],
            ALL,
        ),
        file(
            "slashes.txt",
            r.text("t/ms\tU/V\tI/mA\tn/(1/min)\tphi/°\n", |k| {
                format!("{:.3}\t{:.7}\t{:.5}\t{:.6}\t{:.6}", 1e3 * r.t(k), r.u(k), 1e3 * r.i(k), r.rpm(k), r.deg(k))
            }),
            &[],
            ALL,
        ),
        file(
            "duplicated.csv",
            r.text("time_s,value,value,value\n", |k| format!("{:.6},{:.7},{:.7},{:.7}", r.t(k), r.u(k), r.i(k), r.omega(k))),
            &["--map", "value=u_V", "--map", "value#2=i_A", "--map", "value#3=omega_rad_s"],
            &[("t_s", 1e-6), ("u_V", 1e-5), ("i_A", 1e-5), ("omega_rad_s", 1e-5)],
        ),
        ForeignFile {
            said: "repeat",
            ..file("repeated_rows.csv", repeated_rows(r), &[], &[("t_s", 1e-6), ("u_V", 1e-5), ("i_A", 1e-5), ("omega_rad_s", 1e-5)])
        },
    ]
}

/// Every hundredth row is written twice.
fn repeated_rows(r: &Rows) -> String {
    let mut text = "t_ms,voltage_V,current_A,speed_rpm\n".to_owned();
    for k in 0..ROWS {
        let line = format!("{:.3},{:.7},{:.7},{:.6}\n", 1e3 * r.t(k), r.u(k), r.i(k), r.rpm(k));
        text += &line.repeat(if k % 100 == 50 { 2 } else { 1 });
    }
    text
}

/// Cyrillic text in the encoding of older spreadsheets.
fn windows_1251(text: &str) -> Vec<u8> {
    let byte = |c: char| match c {
        'А'..='я' => (c as u32 - 'А' as u32 + 0xc0) as u8,
        'і' => 0xb3,
        'ї' => 0xbf,
        'є' => 0xba,
        other => other as u8,
    };
    text.chars().map(byte).collect()
}
