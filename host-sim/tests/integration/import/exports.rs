//! Twelve exports of one known record as different systems write them, the last five with defects.

use std::io::{Cursor, Write};

use rust_xlsxwriter::{Format, Workbook};

use super::truth::{Folder, True, comma, lines, truth};

/// Files of an export, and the options that it needs.
pub struct Export {
    pub name: &'static str,
    pub files: Vec<String>,
    pub options: &'static [&'static str],
    /// Values of probes that are lost in it, and rows that are no readings.
    pub lost: usize,
    /// How exactly the export states its numbers, relative.
    pub digits: f64,
}

/// All of them.
pub fn exports(folder: &Folder) -> Vec<Export> {
    let one = |name, file, options| Export { name, files: vec![file], options, lost: 0, digits: 1e-9 };
    vec![
        one("german, comma, byte order mark", folder.write("german.csv", german()), &[]),
        one(
            "american, mil, month first",
            folder.write("american.csv", american()),
            &["--dates", "month-first"],
        ),
        one("components, tabs, UTF-16", folder.write("components.txt", components()), &[]),
        one("workbook, two rows of header", folder.write("book.xlsx", workbook()), &["--lag"]),
        one("open document", folder.write("sheet.ods", open_document()), &[]),
        one("a row for each point", folder.write("points.csv", points()), &[]),
        Export {
            name: "a file for each probe",
            files: (0..2).map(|p| folder.write(&format!("probe{p}.csv"), single(p))).collect(),
            options: &[],
            lost: 0,
            digits: 1e-9,
        },
        one("volts with a sensitivity", folder.write("volts.csv", volts()), &[]),
        Export {
            lost: 2,
            ..one("defect: latin-1, headers again, a footer", folder.write("latin.csv", latin()), &[])
        },
        Export {
            lost: 3,
            ..one(
                "defect: newest first, standstill, no measurement",
                folder.write("newest.csv", newest()),
                &[],
            )
        },
        one("defect: other orders and an overall beside", folder.write("orders.psv", orders()), &["--lead"]),
        Export {
            digits: 1e-6,
            ..one(
                "defect: units in the cells, rounded",
                folder.write("cells.csv", units_in_cells()),
                &["--lag"],
            )
        },
    ]
}

fn stamp(t: &True) -> String {
    let (day, hour) = t.day_and_hour();
    format!("2024-03-{day:02} {hour:02}:00:00")
}

fn german() -> String {
    let head = "\u{feff}Maschine: K-101\r\nErstellt: 12.03.2024 08:15\r\n\r\n\
                Zeitstempel;Drehzahl [1/min];16X 1x Ampl [µm SS];16X 1x Phase [° nacheilend];\
                16Y 1x Ampl [µm SS];16Y 1x Phase [° nacheilend];load_mw\r\n";
    lines(head, |t| {
        let (day, hour) = t.day_and_hour();
        let ([(a, p), (b, q)], n) = ([t.polar(0), t.polar(1)], comma(t.speed_rpm));
        let values = [2.0 * a, p, 2.0 * b, q].map(comma).join(";");
        format!("{day:02}.{:02}.2024 {hour:02}:00;{n};{values};81,5", 3)
    })
}

fn american() -> String {
    let head = "Date/Time,Speed,16X 1X Amp (mil pk-pk),16X 1X Phase (deg lag),16Y 1X Amp (mil pk-pk),16Y 1X Phase (deg lag)\n";
    lines(head, |t| {
        let (day, hour) = t.day_and_hour();
        let (twelve, half) =
            (if hour % 12 == 0 { 12 } else { hour % 12 }, if hour < 12 { "AM" } else { "PM" });
        let [(a, p), (b, q)] = [t.polar(0), t.polar(1)];
        let (a, b) = (2.0 * a / 25.4, 2.0 * b / 25.4);
        format!("3/{day}/2024 {twelve}:00:00 {half},{},{a},{p},{b},{q}", t.speed_rpm)
    })
}

fn components() -> Vec<u8> {
    let head = "time [h]\trpm\t16X cos\t16X sin\t16Y cos\t16Y sin\n\t\tmil rms\tmil rms\tmil rms\tmil rms\n";
    let rms = |um: f64| um / 25.4 / 2.0_f64.sqrt();
    let text = lines(head, |t| {
        let [[a, b], [c, d]] = [t.components(0), t.components(1)].map(|pair| pair.map(rms));
        format!("{}\t{}\t{a}\t{b}\t{c}\t{d}", t.hours, t.speed_rpm)
    });
    text.encode_utf16().flat_map(u16::to_le_bytes).collect()
}

fn workbook() -> Vec<u8> {
    let mut book = Workbook::new();
    let notes = book.add_worksheet().set_name("Notes").unwrap();
    notes.write(0, 0, "Exported by the night shift").unwrap();
    let sheet = book.add_worksheet().set_name("Trend").unwrap();
    let date = Format::new().set_num_format("dd.mm.yyyy hh:mm");
    sheet.write(1, 0, "Compressor, drive end").unwrap();
    sheet.write(3, 2, "16X").unwrap();
    sheet.write(3, 4, "16Y").unwrap();
    for (column, name) in
        ["Timestamp", "Speed", "1X Amplitude", "1X Phase", "1X Amplitude", "1X Phase"].iter().enumerate()
    {
        sheet.write(4, column as u16, *name).unwrap();
    }
    for (column, unit) in ["", "rpm", "µm pk-pk", "deg", "µm pk-pk", "deg"].iter().enumerate() {
        sheet.write(5, column as u16, *unit).unwrap();
    }
    for (row, t) in truth().iter().enumerate() {
        let row = row as u32 + 6;
        let [(a, p), (b, q)] = [t.polar(0), t.polar(1)];
        sheet.write_with_format(row, 0, 45_356.0 + (10.0 + t.hours) / 24.0, &date).unwrap();
        for (column, value) in [t.speed_rpm, 2.0 * a, p, 2.0 * b, q].into_iter().enumerate() {
            sheet.write(row, column as u16 + 1, value).unwrap();
        }
    }
    book.save_to_buffer().unwrap()
}

fn open_document() -> Vec<u8> {
    let text = |text: &str| {
        format!("<table:table-cell office:value-type=\"string\"><text:p>{text}</text:p></table:table-cell>")
    };
    let value = |x: f64| format!("<table:table-cell office:value-type=\"float\" office:value=\"{x}\"/>");
    let row = |cells: String| format!("<table:table-row>{cells}</table:table-row>");
    let head = [
        "time_d",
        "n [1/min]",
        "16X 1x [µm 0-p]",
        "16X Phase [° lag]",
        "16Y 1x [µm 0-p]",
        "16Y Phase [° lag]",
    ];
    let mut rows = row(head.map(text).concat());
    for t in truth() {
        let [(a, p), (b, q)] = [t.polar(0), t.polar(1)];
        rows += &row([t.hours / 24.0, t.speed_rpm, a, p, b, q].map(value).concat());
    }
    let content = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><office:document-content \
         xmlns:office=\"urn:oasis:names:tc:opendocument:xmlns:office:1.0\" \
         xmlns:table=\"urn:oasis:names:tc:opendocument:xmlns:table:1.0\" \
         xmlns:text=\"urn:oasis:names:tc:opendocument:xmlns:text:1.0\" office:version=\"1.2\"><office:body>\
         <office:spreadsheet><table:table table:name=\"Tabelle1\">{rows}</table:table></office:spreadsheet>\
         </office:body></office:document-content>"
    );
    let kind = "application/vnd.oasis.opendocument.spreadsheet";
    let manifest = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><manifest:manifest \
         xmlns:manifest=\"urn:oasis:names:tc:opendocument:xmlns:manifest:1.0\"><manifest:file-entry \
         manifest:full-path=\"/\" manifest:media-type=\"{kind}\"/></manifest:manifest>"
    );
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let stored = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, contents) in
        [("mimetype", kind), ("content.xml", &content), ("META-INF/manifest.xml", &manifest)]
    {
        archive.start_file(name, stored).unwrap();
        archive.write_all(contents.as_bytes()).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

fn points() -> String {
    let head = "Point,Timestamp,Speed (rpm),Direct (µm pp),1X Amp (µm pp),1X Phase (deg lag),Status\n";
    lines(head, |t| {
        let row = |name: &str, p: usize| {
            let ((a, phase), ms) = (t.polar(p), 1_709_632_800_000.0 + 3.6e6 * t.hours);
            format!("{name},{ms},{},{},{},{phase},Valid", t.speed_rpm, 2.4 * a, 2.0 * a)
        };
        format!("{}\n{}", row("16X", 0), row("16Y", 1))
    })
}

fn single(probe: usize) -> String {
    let head = format!(
        "Machine Train: K-101\nChannel: {}\nPhase convention: lead\n\nSpeed (Hz),1X Amp (mm 0-pk),1X Phase (rad)\n",
        ["16X", "16Y"][probe]
    );
    lines(&head, |t| {
        let (amplitude, lag) = t.polar(probe);
        format!("{},{},{}", t.speed_rpm / 60.0, amplitude / 1000.0, -lag.to_radians())
    })
}

fn volts() -> String {
    let head = "Sensitivity: 200 mV/mil\nTime,RPM,16X Amp [mV pp],16X Phase [deg lag],16X Gap [V],16Y Amp [mV pp],16Y Phase [deg lag],16Y Gap [V]\n";
    lines(head, |t| {
        let (day, hour) = t.day_and_hour();
        let [(a, p), (b, q)] = [t.polar(0), t.polar(1)].map(|(um, lag)| (2.0 * um * 200.0 / 25.4, lag));
        format!("2024-03-{day:02}T{hour:02}:00:00+01:00,{},{a},{p},-9.8,{b},{q},-10.1", t.speed_rpm)
    })
}

fn latin() -> Vec<u8> {
    let header =
        "Datum;Uhrzeit;Drehzahl;16X 1x Ampl [µm 0-p];16X Phase [°];16Y 1x Ampl [µm 0-p];16Y Phase [°];\r\n";
    let mut text = format!("Schwingungsprotokoll\r\nPhase: nacheilend\r\n\r\n{header}");
    for (k, t) in truth().iter().enumerate() {
        let (day, hour) = t.day_and_hour();
        let mut thousands = comma(t.speed_rpm);
        thousands.insert(2, '.');
        let [(a, p), (b, q)] = [t.polar(0), t.polar(1)].map(|(a, p)| (comma(a), comma(p)));
        let a = if k == 4 { "k.A.".to_string() } else { a };
        let b = if k == 7 { String::new() } else { b };
        text += &format!("{day:02}.03.2024;{hour:02}:00:00;{thousands};{a};{p};{b};{q};\r\n");
        if k == 5 {
            text += &format!("\r\n{header}");
        }
    }
    text += "\r\nEnde des Protokolls\r\n";
    text.replace("k.A.", "n/a").chars().map(|c| c as u32 as u8).collect()
}

fn newest() -> String {
    let mut rows: Vec<String> = Vec::new();
    for (k, t) in truth().iter().enumerate() {
        let [(a, p), (b, q)] = [t.polar(0), t.polar(1)];
        let a = if k == 3 { -9999.0 } else { a };
        let (b, q) =
            if k == 6 || k == 7 { ("Bad Input".into(), "--".into()) } else { (b.to_string(), q.to_string()) };
        rows.push(format!("{},{},{a},{p},{b},{q}", stamp(t), t.speed_rpm));
        if k == 2 {
            rows.push("2024-03-05 23:30:00,0,0,0,0,0".into());
            rows.push("2024-03-05 23:45:00,,,,,".into());
        }
    }
    rows.reverse();
    let head = "Timestamp,Speed [rpm],16X 1X Amp [um 0-pk],16X 1X Phase [deg lag],16Y 1X Amp [um 0-pk],16Y 1X Phase [deg lag]\n";
    format!("{head}{}\n", rows.join("\n"))
}

fn orders() -> String {
    let head = "Report of train A | all values in µm 0-p | phase in deg\n\
                Date Time|Speed (rpm)|16X (µm)|16X 1X Amp (µm 0-p)|16X 1X Phase (deg)|16X 2X Amp (µm 0-p)|16X 2X Phase (deg)|\
                16Y (µm)|16Y 1X Amp (µm 0-p)|16Y 1X Phase (deg)|Bearing temp (C)\n";
    lines(head, |t| {
        let [(a, p), (b, q)] = [t.polar(0), t.polar(1)].map(|(a, lag)| (a, 720.0 - lag));
        format!("{}|{}|31|{a}|{p}|2.5|77|33|{b}|{q}|81", stamp(t), t.speed_rpm)
    })
}

fn units_in_cells() -> String {
    let head =
        "Date,Time,Speed,\"16X, 1x amplitude\",\"16X, 1x phase\",\"16Y, 1x amplitude\",\"16Y, 1x phase\"\n";
    lines(head, |t| {
        let (day, hour) = t.day_and_hour();
        let [(a, p), (b, q)] = [t.polar(0), t.polar(1)];
        let cells = |a: f64, p: f64| format!("\"{:.6} µm pp\",\"{p:.6} °\"", 2.0 * a);
        format!("{day:02}-Mar-2024,{hour:02}:00:00,{} rpm,{},{}", t.speed_rpm, cells(a, p), cells(b, q))
    })
}
