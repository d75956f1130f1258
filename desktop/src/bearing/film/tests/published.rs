//! Published tables; what each number's source is stands in `tests/data/film/README.md`.

use super::*;

struct Row {
    film: Film,
    sommerfeld: f64,
    eccentricity: f64,
    attitude_deg: f64,
    stiffness: Matrix2<f64>,
    damping: Matrix2<f64>,
}

/// Rows of a table whose x points along the load, −y here, and y across it, +x here.
fn rows(text: &str) -> Vec<Row> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let head = reader.headers().expect("a head").clone();
    let rows = reader.records().map(|record| {
        let record = record.expect("a row");
        let cell = |name: &str| &record[head.iter().position(|h| h == name).expect(name)];
        let number = |name: &str| cell(name).parse::<f64>().expect(name);
        let (ratio, gap) = (number("length_ratio"), number("gap_deg"));
        let film = match cell("kind") {
            "axial_groove" => Film { groove_arc_deg: Some(gap), ..bearing(FilmKind::AxialGroove, ratio) },
            "elliptical" => Film { groove_arc_deg: Some(gap), ..lemon(ratio, number("preload")) },
            _ => Film { pad_arc_deg: Some(90.0 - gap), ..pads(4, PadLoad::BetweenPads, number("preload")) },
        };
        Row {
            film,
            sommerfeld: number("sommerfeld"),
            eccentricity: number("eccentricity"),
            attitude_deg: number("attitude_deg"),
            stiffness: Matrix2::new(number("kyy"), -number("kyx"), -number("kxy"), number("kxx")),
            damping: Matrix2::new(number("byy"), -number("byx"), -number("bxy"), number("bxx")),
        }
    });
    rows.collect()
}

/// Each row with our equilibrium at its Sommerfeld number.
fn compared(rows: Vec<Row>) -> Vec<(Row, Equilibrium)> {
    let mut tables: Vec<(Film, FilmTable)> = Vec::new();
    rows.into_iter()
        .map(|row| {
            if tables.last().is_none_or(|(film, _)| *film != row.film) {
                tables.push((row.film.clone(), FilmTable::solve(&row.film).expect("a table")));
            }
            let ours = tables[tables.len() - 1].1.at(row.sommerfeld).expect("within range");
            (row, ours)
        })
        .collect()
}

#[test]
fn lund_thomsen_1978_groove_and_elliptical_within_1_percent() {
    let rows = rows(include_str!("../../../../tests/data/film/lund_thomsen_1978.csv"));
    assert_eq!(rows.len(), 25);
    for (row, ours) in compared(rows) {
        let s = row.sommerfeld;
        assert!((ours.eccentricity_ratio / row.eccentricity - 1.0).abs() < 0.005, "{s} {ours:?}");
        // one attitude of the printed table, 83.29 between 87.79 and 81.80, is off its own neighbours' curve
        let allowed = if row.attitude_deg == 83.29 { 2.1 } else { 0.15 };
        assert!((ours.attitude_deg - row.attitude_deg).abs() < allowed, "{s} {ours:?}");
        assert!(apart(&ours.stiffness, &row.stiffness) < 0.01, "{s} {}", ours.stiffness);
        assert!(apart(&ours.damping, &row.damping) < 0.01, "{s} {}", ours.damping);
    }
}

#[test]
fn raimondi_boyd_1958_plain_within_1_percent_and_half_degree() {
    let text = include_str!("../../../../tests/data/film/raimondi_boyd_1958.csv");
    let mut tables: Vec<(f64, FilmTable)> = Vec::new();
    for record in csv::Reader::from_reader(text.as_bytes()).records() {
        let record = record.expect("a row");
        let [ratio, eccentricity, sommerfeld, attitude_deg] =
            std::array::from_fn(|i| record[i].parse::<f64>().expect("a number"));
        if tables.last().is_none_or(|t| t.0 != ratio) {
            let film = bearing(FilmKind::Plain, ratio);
            tables.push((ratio, FilmTable::solve(&film).expect("a table")));
        }
        let ours = tables[tables.len() - 1].1.at(sommerfeld).expect("within range");
        assert!((ours.eccentricity_ratio / eccentricity - 1.0).abs() < 0.01, "{ours:?}");
        assert!((ours.attitude_deg - attitude_deg).abs() < 0.5, "{ours:?}");
    }
}

/// Someya's damping and statics; his stiffness of grooved bearings keeps the film's edges at the line of centres
/// and is another model's (it tends to `±1/ε` off the diagonal, as a bearing without grooves).
#[test]
fn someya_1989_grooves_statics_within_1_and_damping_6_percent() {
    let text = include_str!("../../../../tests/data/film/someya_1989.csv");
    let grooved = rows(text).into_iter().filter(|r| r.film.kind == FilmKind::AxialGroove);
    for (row, ours) in compared(grooved.collect()) {
        let s = row.sommerfeld;
        assert!((ours.eccentricity_ratio / row.eccentricity - 1.0).abs() < 0.01, "{s} {ours:?}");
        assert!((ours.attitude_deg - row.attitude_deg).abs() < 3.0, "{s} {ours:?}");
        assert!(apart(&ours.damping, &row.damping) < 0.06, "{s} {}", ours.damping);
    }
}

#[test]
fn someya_1989_two_lobes_stiffness_within_2_damping_4_percent() {
    let text = include_str!("../../../../tests/data/film/someya_1989.csv");
    let lobes =
        rows(text).into_iter().filter(|r| r.film.kind == FilmKind::Elliptical && r.eccentricity < 0.95);
    for (row, ours) in compared(lobes.collect()) {
        let s = row.sommerfeld;
        assert!((ours.attitude_deg - row.attitude_deg).abs() < 0.3, "{s} {ours:?}");
        assert!(apart(&ours.stiffness, &row.stiffness) < 0.02, "{s} {}", ours.stiffness);
        assert!(apart(&ours.damping, &row.damping) < 0.04, "{s} {}", ours.damping);
    }
}

/// At lighter loads than these ours stand nearer to the middle than his (0.052 for 0.1, 0.163 for 0.2: without a
/// load the film of a pad with its pivot in the middle carries by its curvature alone), and at the heaviest his
/// damping is 15 % below ours, and not smooth itself (2.97, 2.99, 3.11, 3.05).
#[test]
fn someya_1989_four_tilting_pads_within_7_percent() {
    let text = include_str!("../../../../tests/data/film/someya_1989.csv");
    let tilting = rows(text).into_iter().filter(|r| r.film.kind == FilmKind::TiltingPad);
    for (row, ours) in compared(tilting.filter(|r| (0.3..1.15).contains(&r.eccentricity)).collect()) {
        let (s, off) = (row.sommerfeld, |a: f64, b: f64| (a / b - 1.0).abs());
        assert!(off(ours.eccentricity_ratio, row.eccentricity) < 0.05, "{s} {ours:?}");
        for axis in 0..2 {
            assert!(off(ours.stiffness[(axis, axis)], row.stiffness[(axis, axis)]) < 0.07, "{s} {ours:?}");
            assert!(off(ours.damping[(axis, axis)], row.damping[(axis, axis)]) < 0.05, "{s} {ours:?}");
        }
        assert!(ours.attitude_deg.abs() < 1e-6);
    }
}
