//! Campaigns: the answers of `explain` on fixed sets of logs, compared with those of the last accepted commit.
//!
//! A set is a list of names; a name determines its log. `tests/baselines/` holds, for each set, what the generator made (`*-logs.csv`: hash
//! of log and model, what is hidden and whether it is visible) and what `explain` answered (`*.csv`). A changed simulator makes logs of
//! another hash, which are not compared: a new set is then written, on which the old and the new program are both run. A changed engine
//! changes answers.
//!
//! * [`case`]: a log, the user's model and the truth by name;
//! * [`sets`]: the names of each set;
//! * [`visible`]: whether a hidden effect is visible, by the generator;
//! * [`record`]: the lines of the CSVs;
//! * [`run`]: answers on all cores, kept line by line;
//! * [`judge`]: right or wrong, and coverage;
//! * [`compare`]: two runs of a set;
//! * [`planted`]: effects planted at the detection limits of logs with nothing missing;
//! * [`coverage`]: coverage of the uncertainties of `fit`, `calibrate`, `drift` and `allan`;
//! * [`inputs`]: hashes of logs and models;
//! * [`figures`]: the page docs/figures.md.

pub mod case;
pub mod compare;
pub mod coverage;
pub mod figures;
pub mod inputs;
pub mod judge;
pub mod planted;
pub mod record;
pub mod run;
pub mod sets;
pub mod visible;
