//! Oscilloscopes and data acquisition: Tektronix, Keysight, Rigol, Siglent, PicoScope, Saleae, LabVIEW, Dewesoft, imc.

use super::{ForeignFile, ROWS, Rows, comma, file};

const UI: &[(&str, f64)] = &[("u_V", 1e-5), ("i_A", 1e-5)];
const UIW: &[(&str, f64)] = &[("t_s", 1e-6), ("u_V", 1e-5), ("i_A", 1e-5), ("omega_rad_s", 1e-5)];

pub(super) fn files(r: &Rows) -> Vec<ForeignFile> {
    vec![
        ForeignFile { said: "lines before it", ..tektronix(r) },
        tektronix_tds(r),
        file(
            "keysight.csv",
            r.text("x-axis,1,2,3\nsecond,Volt,Ampere,Volt\n", |k| {
                format!("{:+.5E},{:+.6E},{:+.6E},{:+.6E}", r.t(k) - 1.0, r.u(k), r.i(k), r.omega(k) / 10.0)
            }),
            &["--map", "3=i_A", "--map", "2=u_V", "--map", "4=omega_rad_s", "--unit", "4=10 rad/s"],
            &[("u_V", 1e-5), ("i_A", 1e-5), ("omega_rad_s", 1e-5)],
        ),
        ForeignFile {
            said: "increment",
            ..file(
                "rigol.csv",
                r.text("X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-1.000000e+00,1.000000e-03\n", |k| {
                    format!("{k},{:.6e},{:.6e},", r.u(k), r.i(k))
                }),
                &["--map", "X=-", "--sample-rate", "1000", "--map", "CH1=u_V", "--map", "CH2=i_A", "--unit", "CH2=1 A"],
                UI,
            )
        },
        file("siglent.csv", siglent(r), &["--map", "3=i_A", "--unit", "3=A", "--map", "2=u_V"], UI),
        file(
            "picoscope.csv",
            r.text("Time,Channel A,Channel B\n(ms),(V),(mV)\n\n", |k| format!("{:.8},{:.8},{:.8}", 1e3 * r.t(k), r.u(k), 1e3 * r.i(k))),
            &["--map", "Channel A=u_V", "--map", "Channel B=i_A", "--unit", "Channel B=1 mA"],
            &[("t_s", 1e-6), ("u_V", 1e-5), ("i_A", 1e-5)],
        ),
        file(
            "saleae.csv",
            r.text("Time [s],Channel 0,Channel 1\n", |k| format!("{:.9},{:.7},{:.7}", r.t(k), r.u(k), r.i(k))),
            &["--map", "Channel 0=u_V", "--map", "Channel 1=i_A", "--unit", "Channel 1=1 A"],
            &[("t_s", 1e-6), ("u_V", 1e-5), ("i_A", 1e-5)],
        ),
        file("labview.lvm", labview(r, '.'), &[], UIW),
        file("labview_de.lvm", labview(r, ','), &[], UIW),
        file(
            "dewesoft.txt",
            r.text(
                "Data info\r\nFile name: run_0001.dxd\r\nStart time: 2024-05-01 12:00:00\r\nSample rate: 1000 Hz\r\nStore type: always fast\r\n\
                 Channels: 3\r\n\r\nData1\r\nTime\tMotor voltage\tMotor current\tSpeed\r\n(s)\t(V)\t(A)\t(rpm)\r\n",
                |k| format!("{:.6}\t{:.7}\t{:.7}\t{:.6}\r", r.t(k), r.u(k), r.i(k), r.rpm(k)),
            ),
            &[],
            UIW,
        ),
        file(
            "imc.asc",
            r.text("Zeit [s]\tUmot [V]\tImot [mA]\tn_Motor [1/min]\r\n", |k| {
                comma(format!("{:.6}\t{:.7}\t{:.5}\t{:.6}\r", r.t(k), r.u(k), 1e3 * r.i(k), r.rpm(k)))
            }),
            &[],
            UIW,
        ),
    ]
}

fn tektronix(r: &Rows) -> ForeignFile {
    let text = r.text(
        "Model,MSO44\r\nFirmware Version,1.28.8.6840\r\n\r\nWaveform Type,ANALOG,,,\r\nPoint Format,Y,,,\r\nHorizontal Units,s,,,\r\n\
         Horizontal Scale,0.4,,,\r\nHorizontal Delay,0,,,\r\nSample Interval,0.001,,,\r\nRecord Length,3000,,,\r\nGating,0.0% to 100.0%,,,\r\n\
         Probe Attenuation,1,10,\r\nVertical Units,V,A,\r\nVertical Offset,0,0,\r\nVertical Scale,1,0.1,\r\nVertical Position,0,0,\r\n,,,\r\n,,,\r\n\
         ,,,\r\nLabel,,,\r\nTIME,CH1,CH2\r\n",
        |k| format!("{:.7e},{:.7},{:.7}\r", r.t(k) - 1.0, r.u(k), r.i(k)),
    );
    file("tektronix.csv", text, &["--map", "CH1=u_V", "--map", "CH2=i_A"], UI)
}

/// The two-channel form of the TDS series: a block of facts beside the first rows.
fn tektronix_tds(r: &Rows) -> ForeignFile {
    let facts =
        ["Record Length,3.000000e+03", "Sample Interval,1.000000e-03", "Trigger Point,1.000000e+03", "Source,CH1", "Vertical Units,V"];
    let text =
        r.text("", |k| format!("{},,{:018.11},{:10.5},{:10.5},", facts.get(k).copied().unwrap_or(","), r.t(k) - 1.0, r.u(k), r.i(k)));
    let stated = &["--map", "column_4=t_s", "--map", "column_5=u_V", "--map", "column_6=i_A"];
    file("tektronix_tds.csv", text, stated, &[("u_V", 1e-4), ("i_A", 1e-3)])
}

fn siglent(r: &Rows) -> String {
    r.text(
        "Record Length,Analog:3000\nSample Interval,Analog:0.001000\nVertical Units,CH1:V,CH2:V\nVertical Scale,CH1:0.5,CH2:0.05\n\
         Vertical Offset,CH1:0,CH2:0\nHorizontal Units,s\nHorizontal Scale,0.2\nModel Number,SDS1104X-E\nSerial Number,SDSMM000000000\n\
         Software Version,8.1.6.1.33\nSource,CH1,CH2\nSecond,Volt,Volt\n",
        |k| format!("{:.8},{:.6},{:.6}", r.t(k) - 1.0, r.u(k), r.i(k)),
    )
}

fn labview(r: &Rows, decimal: char) -> String {
    let sep = if decimal == ',' { ";" } else { "\t" };
    let header = format!(
        "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\t{}\nDecimal_Separator\t{decimal}\nMulti_Headings\tNo\n\
         X_Columns\tOne\nTime_Pref\tAbsolute\nOperator\tlab\nDate\t2024/05/01\nTime\t12:00:00,0000000\n***End_of_Header***\t\n\t\n\
         Channels\t3\t\t\t\nSamples\t{ROWS}\t{ROWS}\t{ROWS}\t\nDate\t2024/05/01\t2024/05/01\t2024/05/01\t\n\
         Time\t12:00:00,0000000\t12:00:00,0000000\t12:00:00,0000000\t\nY_Unit_Label\tV\tA\trad/s\t\nX_Dimension\tTime\tTime\tTime\t\n\
         X0\t0.0000000000000000E+0\t0.0000000000000000E+0\t0.0000000000000000E+0\t\nDelta_X\t0.001000\t0.001000\t0.001000\t\n\
         ***End_of_Header***\t\t\t\t\nX_Value\tVoltage\tCurrent\tSpeed\tComment\n",
        if decimal == ',' { "Semicolon" } else { "Tab" }
    );
    let text = r.text(&header, |k| format!("{:.6}\t{:.7}\t{:.7}\t{:.7}", r.t(k), r.u(k), r.i(k), r.omega(k)));
    if decimal == ',' { text.replace('.', ",").replace('\t', sep) } else { text }
}
