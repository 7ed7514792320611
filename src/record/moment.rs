//! Time of day and date, as loggers write them.
//!
//! Times count from the first of a column, in whole nanoseconds until then: seconds since 1970 would leave an `f64` too few
//! digits for an interval of a millisecond.

const SECOND: i64 = 1_000_000_000;
const DAY: i64 = 86_400 * SECOND;

/// A time of day, perhaps with its date and its distance from UTC.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moment {
    date: Option<Date>,
    /// Since midnight, in ns; in UTC, where the zone is known.
    time: i64,
    zoned: bool,
}

/// A day.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Date {
    /// Since 1970-01-01.
    days: i64,
    /// Whether day and month, or the year, could be exchanged.
    ambiguous: bool,
}

impl Moment {
    /// `10:22:31.250`, `2024-03-14T10:22:31,25Z`, `14.03.2024 10:22:31`, `03/14/2024 10:22:31 PM`, `14-Mar-2024 10:22:31`.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        if !text.starts_with(|c: char| c.is_ascii_digit()) || !text.contains(':') {
            return None;
        }
        let (date, time) = match text.split_once(|c: char| c == 'T' || c.is_whitespace()) {
            Some((date, time)) if !date.contains(':') => (Some(Date::parse(date)?), time.trim()),
            _ => (None, text),
        };
        let (time, east) = without_zone(time)?;
        Some(Self {
            date,
            time: time_of_day(time)? - east.unwrap_or(0),
            zoned: east.is_some(),
        })
    }
}

/// The moments of a column.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Moments {
    first: Moment,
    /// How the first is written.
    pub(super) written: String,
    last: Moment,
    /// How often a time of day without a date has begun anew.
    pub(super) midnights: i64,
}

impl Moments {
    pub(super) fn from(first: Moment, written: &str) -> Self {
        Self {
            first,
            written: written.into(),
            last: first,
            midnights: 0,
        }
    }

    /// The next of them, in s since the first; `None` where it is written in another way, or it is not clear which day it is.
    pub(super) fn next(&mut self, moment: Moment) -> Option<f64> {
        let days = match (self.first.date, moment.date) {
            (None, None) => {
                // A time of day that falls by most of a day has passed midnight.
                self.midnights += i64::from(moment.time < self.last.time - DAY / 2);
                self.midnights
            }
            (Some(first), Some(date)) => {
                let days = date.days - first.days;
                if days != 0 && (first.ambiguous || date.ambiguous) {
                    return None;
                }
                days
            }
            _ => return None,
        };
        if moment.zoned != self.first.zoned {
            return None;
        }
        self.last = moment;
        let passed = i128::from(days) * i128::from(DAY) + i128::from(moment.time - self.first.time);
        Some(passed as f64 / SECOND as f64)
    }

    /// From the first of `self` to the first of `other`, in s; `None` where they do not tell.
    pub(super) fn until(&self, other: &Self) -> Option<f64> {
        Self::from(self.first, "").next(other.first)
    }
}

/// A number of digits alone, at most so many.
fn digits(text: &str, most: usize) -> Option<i64> {
    let all = (1..=most).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit());
    all.then(|| text.parse().ok())?
}

impl Date {
    fn parse(text: &str) -> Option<Self> {
        const MONTHS: [&str; 12] = [
            "jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec",
        ];
        let text = text.trim_end_matches(',');
        let mark = text.chars().find(|mark| "-/.".contains(*mark))?;
        let parts: Vec<&str> = text.split(mark).collect();
        let [one, two, three] = parts[..] else {
            return None;
        };
        let named = MONTHS
            .iter()
            .position(|month| month.eq_ignore_ascii_case(two));
        let year = |text: &str| {
            let year = digits(text, 4)?;
            match text.len() {
                4 => Some(year),
                2 => Some(2000 + year),
                _ => None,
            }
        };
        if let Some(month) = named {
            return Self::of(year(three)?, month as i64 + 1, digits(one, 2)?, false);
        }
        let [first, second] = [digits(one, 4)?, digits(two, 2)?];
        match (one.len(), mark) {
            (4, _) => Self::of(first, second, digits(three, 2)?, false),
            (_, '.') => Self::of(year(three)?, second, first, false),
            // Which number is the year, the month and the day is the habit of a country.
            _ if three.len() == 2 => match (first, second) {
                (..=12, _) => Self::of(year(three)?, first, second, true),
                _ => Self::of(year(three)?, second, first, true),
            },
            _ if first > 12 => Self::of(year(three)?, second, first, false),
            _ => Self::of(year(three)?, first, second, second <= 12 && first != second),
        }
    }

    fn of(year: i64, month: i64, day: i64, ambiguous: bool) -> Option<Self> {
        let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
        let lengths = [
            31,
            28 + i64::from(leap),
            31,
            30,
            31,
            30,
            31,
            31,
            30,
            31,
            30,
            31,
        ];
        let before = usize::try_from(month - 1).ok()?;
        let length = *lengths.get(before)?;
        if !(1900..=2999).contains(&year) || !(1..=length).contains(&day) {
            return None;
        }
        let leap_days = |year: i64| year / 4 - year / 100 + year / 400;
        let years = 365 * (year - 1970) + leap_days(year - 1) - leap_days(1969);
        Some(Self {
            days: years + lengths[..before].iter().sum::<i64>() + day - 1,
            ambiguous,
        })
    }
}

/// What stands before `Z`, `+01:00` or `-0530`, and how far east of UTC that is, in ns.
fn without_zone(text: &str) -> Option<(&str, Option<i64>)> {
    if let Some(time) = text.strip_suffix(['Z', 'z']) {
        return Some((time.trim_end(), Some(0)));
    }
    let Some(at) = text.find(['+', '-']) else {
        return Some((text, None));
    };
    let sign = if text[at..].starts_with('+') { 1 } else { -1 };
    let zone = text[at + 1..].replace(':', "");
    let number = digits(&zone, 4)?;
    let minutes = match zone.len() {
        2 => 60 * number,
        4 => 60 * (number / 100) + number % 100,
        _ => return None,
    };
    Some((text[..at].trim_end(), Some(sign * minutes * 60 * SECOND)))
}

/// `10:22:31.250`, `10:22:31,250`, `10:22:31:250` or `10:22:31 PM`, in ns since midnight.
fn time_of_day(text: &str) -> Option<i64> {
    let half = |suffix: &str| {
        let at = text.len().checked_sub(2)?;
        let (time, end) = text.split_at_checked(at)?;
        end.eq_ignore_ascii_case(suffix).then(|| time.trim_end())
    };
    let (text, afternoon) = match (half("AM"), half("PM")) {
        (Some(time), _) => (time, Some(false)),
        (_, Some(time)) => (time, Some(true)),
        _ => (text, None),
    };
    let mut parts = text.splitn(3, ':');
    let hour = digits(parts.next()?, 2)?;
    let minute = digits(parts.next().filter(|part| part.len() == 2)?, 2)?;
    let seconds = parts.next()?;
    let (second, fraction) = match seconds.split_once(['.', ',', ':']) {
        Some((second, fraction)) => (second, fraction),
        None => (seconds, "0"),
    };
    let second = digits(Some(second).filter(|part| part.len() == 2)?, 2)?;
    digits(fraction.get(..9).unwrap_or(fraction), 9)?;
    if !fraction.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let padded: String = fraction.chars().chain("00000000".chars()).take(9).collect();
    let hour = match afternoon {
        None if hour < 24 => hour,
        Some(afternoon) if (1..=12).contains(&hour) => hour % 12 + 12 * i64::from(afternoon),
        _ => return None,
    };
    let whole = 3600 * hour + 60 * minute + second;
    (minute < 60 && second < 60).then_some(whole * SECOND + digits(&padded, 9)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From one to the other, in s.
    fn between(one: &str, other: &str) -> Option<f64> {
        let one = Moment::parse(one).unwrap_or_else(|| panic!("{one}"));
        let other = Moment::parse(other).unwrap_or_else(|| panic!("{other}"));
        Moments::from(one, "").next(other)
    }

    #[test]
    fn moments_are_read_to_the_nanosecond() {
        for (one, other, seconds) in [
            ("10:22:31.250", "10:22:31.251", 1e-3),
            ("10:22:31,25", "10:22:31,2501", 1e-4),
            ("10:22:31:250", "10:22:32:000", 0.75),
            ("9:59:59", "10:00:00.000000001", 1.000_000_001),
            ("23:59:59.5", "00:00:00.25", 0.75),
            ("2024-03-14T10:22:31", "2024-03-14 10:22:31.5", 0.5),
            ("2024-02-28 23:59:59", "2024-03-01 00:00:00", 86_401.0),
            ("2023-12-31 23:59:59", "2024-01-01 00:00:01", 2.0),
            (
                "1999-12-31 00:00:00",
                "2000-03-01 00:00:00",
                61.0 * 86_400.0,
            ),
            ("14.03.2024 10:22:31,250", "15.03.2024 00:00:00", 49_048.75),
            ("14.03.24 10:22:31", "14.03.24 10:22:32", 1.0),
            ("03/14/2024 10:22:31 AM", "03/14/2024 10:22:31 PM", 43_200.0),
            ("03/14/2024 12:00:01 am", "03/14/2024 12:00:01 PM", 43_200.0),
            ("31/12/2023 23:59:59", "2024-01-01 00:00:00", 1.0),
            ("03/04/2024 10:22:31", "03/04/2024 10:22:31.1", 0.1),
            ("14-Mar-2024 10:22:31", "15-MAR-2024 10:22:31", 86_400.0),
            ("2024/03/14 10:22:31", "2024-03-14T10:22:31", 0.0),
            ("2024-03-14T10:22:31Z", "2024-03-14T11:22:31.5+01:00", 0.5),
            ("2024-03-14 00:10:00+0100", "2024-03-13 23:10:00Z", 0.0),
            ("2024-03-14T10:22:31-05", "2024-03-14T10:22:31-0530", 1800.0),
        ] {
            assert_eq!(between(one, other), Some(seconds), "{one}, {other}");
        }
    }

    #[test]
    fn what_does_not_tell_when_it_was_is_no_moment() {
        for (one, other) in [
            // The third of April, or the fourth of March?
            ("03/04/2024 23:59:59", "03/05/2024 00:00:00"),
            ("03/04/24 23:59:59", "13/04/24 00:00:00"),
            ("10:22:31", "2024-03-14 10:22:31"),
            ("2024-03-14 10:22:31", "2024-03-14 10:22:32Z"),
        ] {
            assert_eq!(between(one, other), None, "{one}, {other}");
        }
        for text in [
            "",
            "1.5",
            "2024-03-14",
            "22:31.3",
            "10:22",
            "24:00:00",
            "10:60:00",
            "10:22:61",
            "13:22:31 PM",
            "0:22:31 AM",
            "2024-13-01 00:00:00",
            "2023-02-29 00:00:00",
            "31.04.2024 00:00:00",
            "2024-03-14 10:22:31+1",
            "10:22:31.",
            "10:22:31.2.5",
            "10:22:31 Uhr",
            "1:2:3:4:5",
            "10:22:31°",
            "ä0:22:31",
        ] {
            assert_eq!(Moment::parse(text), None, "{text:?}");
        }
    }
}
