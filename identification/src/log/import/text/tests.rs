use super::*;

fn table(text: &str) -> Table {
    parse(text, None).expect("a table")
}

fn names_of(table: &Table) -> Vec<&str> {
    table.columns.iter().map(|c| c.name.as_str()).collect()
}

#[test]
fn separators_and_decimal_marks_are_found() {
    for (text, separator, decimal) in [
        ("t;u\n0,001;1,5\n0,002;2,5\n", ';', ','),
        ("t\tu\n0,001\t1,5\n0,002\t2,5\n", '\t', ','),
        ("t,u\n0.001,1.5\n0.002,2.5\n", ',', '.'),
        ("t u\n0.001   1.5\n0.002  2.5\n", ' ', '.'),
        ("t|u\n0.001|1.5\n0.002|2.5\n", '|', '.'),
    ] {
        let table = table(text);
        assert_eq!(table.dialect, Some(Dialect { separator, decimal, has_header: true }), "{text}");
        assert_eq!(names_of(&table), ["t", "u"]);
        assert_eq!(
            (table.columns[0].values.as_slice(), table.columns[1].values.as_slice()),
            (&[0.001, 0.002][..], &[1.5, 2.5][..]),
            "{text}"
        );
    }
}

#[test]
fn preamble_units_and_missing_cells_are_understood() {
    let scope = "Logger 3000\nRate: 1000 Hz\n\nTime,Channel A\n(ms),(mV)\n\n0,12.5\n1,\n2,13.5\n";
    let table = table(scope);
    assert_eq!(names_of(&table), ["Time", "Channel A"]);
    assert_eq!((table.columns[0].unit.as_str(), table.columns[1].unit.as_str()), ("ms", "mV"));
    assert_eq!((table.preamble, table.rows(), table.columns[1].missing()), (2, 3, 1));
}

#[test]
fn header_may_be_missing_or_in_a_comment() {
    assert_eq!(names_of(&table("0.0 1.5 2\n0.1 2.5 3\n")), ["column_1", "column_2", "column_3"]);
    assert_eq!(names_of(&table("# t u omega\n0.0 1.5 2\n0.1 2.5 3\n")), ["t", "u", "omega"]);
}

#[test]
fn dates_are_seconds() {
    let table = table("time;speed\n2024-05-01 12:00:00.000;1\n2024-05-01 12:00:00.010;2\n");
    assert!(table.columns[0].is_date);
    let t = &table.columns[0].values;
    assert!((t[1] - t[0] - 0.01).abs() < 1e-6, "{t:?}");
}

#[test]
fn lines_that_are_no_rows_are_skipped_and_counted() {
    let joined = table("t,u\n0.1,1.5\n0.2,2.5\n0.3,1\nt,u\n0.1,3.5\n0.2,4.5\n");
    assert_eq!((joined.rows(), joined.skipped.len(), joined.skipped[0].reason), (5, 1, SkipReason::RepeatedHeader));
    let cut = table("t,u,i\n0.1,1.5,1\n0.2,2.5,2\n0.3,3.5,3\n0.4,4.5");
    assert_eq!((cut.rows(), cut.skipped[0].reason, cut.skipped[0].line), (3, SkipReason::Cut, 5));
    let many = parse("t,u\n0.1,1.5\nfault, stop\n0.2,2.5\nfault, stop\n0.3,2.5\n", None);
    assert!(matches!(many, Err(LogErrorKind::NoRowsBetween { lines: 2, rows: 3, line: 3, .. })), "{many:?}");
}

#[test]
fn facts_before_the_rows_are_no_rows() {
    let scope = table(
        "Model,X\nSample Interval,0.001,\nProbe Attenuation,1,10\nVertical Units,V,A\nTIME,CH1,CH2\n-0.1,1.5,2\n-0.099,2.5,3\n-0.098,2,3\n",
    );
    assert_eq!(names_of(&scope), ["TIME", "CH1", "CH2"]);
    assert_eq!(scope.columns.iter().map(|c| c.unit.as_str()).collect::<Vec<_>>(), ["", "V", "A"]);
    assert_eq!(scope.stated_interval.map(|s| s.0), Some(0.001));
}

#[test]
fn names_of_rows_shift_no_column() {
    let r = table("\"t\" \"u\"\n\"1\" 0.1 1.5\n\"2\" 0.2 2.5\n");
    assert_eq!(names_of(&r), ["column_1", "t", "u"]);
    assert_eq!(r.columns[1].values, [0.1, 0.2]);
}
