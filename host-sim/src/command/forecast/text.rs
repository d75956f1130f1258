//! What `forecast` prints for people.

use rotor_edge_desktop::forecast::ahead::interval;
use rotor_edge_desktop::forecast::limit::FirstPassage;
use rotor_edge_desktop::forecast::scores::Score;
use rotor_edge_desktop::forecast::series::History;

use super::super::dates::Dates;
use super::{
    Arguments, Forecast, SCORES, against_naive, event_chance, event_in_words, limit_in_words, unit, words,
};

/// One score of every method at every horizon.
fn table(arguments: &Arguments, forecasts: &[Forecast], title: &str, of: fn(&Score) -> f64, share: bool) {
    println!("{title}");
    print!("  {:<20} {:<6}", "series", "model");
    arguments.horizons.iter().for_each(|h| print!(" {:>9}", format!("{h} d")));
    println!();
    for f in forecasts {
        for (k, (name, scores)) in f.scores.iter().enumerate() {
            let unit = if share { String::new() } else { format!(", {}", unit(f.series)) };
            let label = if k == 0 { format!("{}{unit}", words(f.series)) } else { String::new() };
            print!("  {label:<20} {name:<6}");
            for value in scores.iter().map(of) {
                match (value.is_finite(), share) {
                    (false, _) => print!(" {:>9}", "–"),
                    (true, false) => print!(" {value:>9.2}"),
                    (true, true) => print!(" {:>7.1} %", 100.0 * value),
                }
            }
            println!();
        }
    }
    println!();
}

/// Scores of the past, the forecast, and the limit.
pub fn print(
    arguments: &Arguments,
    history: &History,
    forecasts: &[Forecast],
    limit: Option<&FirstPassage>,
    dates: Dates,
) {
    println!("Forecasts made on every day of the past after {}, and what became of them\n", arguments.first);
    for (title, of, share) in SCORES {
        table(arguments, forecasts, title, of, share);
    }
    against_naive(forecasts, &arguments.horizons).iter().for_each(|line| println!("{line}"));
    println!("\nIn {} days, on {}", arguments.days, dates.day(history.last_d() + arguments.days as f64));
    for f in forecasts {
        let k = arguments.days - 1;
        let [low, high] = interval(f.ahead.mean[k], f.ahead.sd[k]);
        println!(
            "  {:<14} {:>9.1}, between {low:.1} and {high:.1} with 95 %",
            words(f.series),
            f.ahead.mean[k]
        );
    }
    if let Some(chance) = event_chance(history, arguments.days) {
        println!("  {}", event_in_words(history, arguments.days, chance));
    }
    match limit {
        Some(limit) => println!(
            "\n{}\nNext: have correction weights ready before then, with rotor-edge balance",
            limit_in_words(limit, history.last_d(), dates)
        ),
        None => println!(
            "\nNext: say at which static unbalance in g·mm the machine has to be balanced, with --limit, and read when that is"
        ),
    }
}
