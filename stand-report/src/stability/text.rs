//! Rate stability for a terminal.

use super::words::{STANDARD, resolution, scales, verdict, width};
use crate::uncertainty::{FOOTNOTE, estimate};
use crate::units::Units;
use crate::{plain, significant};
use stand_analysis::stability::PlateauStability;

/// The plateaus with the scatter over each width.
pub fn text(log: &str, plateaus: &[PlateauStability], units: Units) -> String {
    let (rate, ratio) = scales(units);
    let mut out = format!("{log}: rate stability ({STANDARD}), standard deviation of the mean rates over windows, relative to the mean\n");
    for plateau in plateaus {
        out += &format!(
            "from {} s, {} s, {} whole turns: mean rate {}",
            plain(plateau.start_s, 5),
            plain(plateau.duration_s, 4),
            plateau.turns,
            estimate(&plateau.mean_rad_s, &rate)
        );
        if let Some(command) = plateau.command_rad_s {
            let off = plateau.mean_rad_s.value / command - 1.0;
            out += &format!(", {} {} from the setpoint", significant(off * ratio.factor, 2), ratio.unit);
        }
        out += "\n";
        for found in &plateau.widths {
            let remarks: Vec<String> = [resolution(found, &ratio), found.verdict.map_or(String::new(), |v| verdict(v).to_owned())]
                .into_iter()
                .filter(|remark| !remark.is_empty())
                .collect();
            let remarks = if remarks.is_empty() { String::new() } else { format!("; {}", remarks.join("; ")) };
            out +=
                &format!("  {:<12} {}, {} windows{remarks}\n", width(found.width), estimate(&found.sigma, &ratio), found.deviations.len());
        }
    }
    out + &format!("{FOOTNOTE}\n")
}
