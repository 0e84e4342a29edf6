//! TOML text into types; errors name line and key.

use std::path::Path;

use serde::de::DeserializeOwned;

use super::whole::Whole;
use super::{nearest, plain};
use crate::{Error, Result};

/// Reads TOML text into `T`; `name` is its name in errors.
///
/// # Errors
/// As [`from_toml`](super::from_toml), except those of the file.
pub fn parse_toml<T: DeserializeOwned>(text: &str, name: &Path) -> Result<T> {
    read(text).map_err(|e| {
        let fits = |text: &str| read::<T>(text).is_ok();
        Error::content(name, explain(&e, text, fits))
    })
}

fn read<T: DeserializeOwned>(text: &str) -> std::result::Result<T, toml::de::Error> {
    T::deserialize(Whole(toml::Deserializer::parse(text)?))
}

/// Largest number of lines of a table that are tried one by one.
const LINES_TRIED: usize = 64;

/// Line and key at fault in the table whose header is on line `header`, for errors that locate only the table: the
/// line whose removal makes the table valid.
fn culprit(text: &str, header: usize, fits: impl Fn(&str) -> bool) -> Option<String> {
    let lines: Vec<&str> = text.lines().collect();
    let table =
        lines.iter().enumerate().skip(header).take_while(|(_, line)| !line.trim_start().starts_with('['));
    for (index, line) in table.take(LINES_TRIED) {
        let Some((key, _)) = line.split_once('=') else { continue };
        let mut others = lines.clone();
        others[index] = "";
        if fits(&others.join("\n")) {
            return Some(format!("line {}: {}: ", index + 1, key.trim()));
        }
    }
    None
}

/// One line: location, error, and the most similar valid key.
fn explain(error: &toml::de::Error, text: &str, fits: impl Fn(&str) -> bool) -> String {
    let message = plain(&error.message().trim().replace('\n', " "));
    let place = error.span().map_or(String::new(), |span| {
        let at = span.start.min(text.len());
        let line = text[..at].matches('\n').count() + 1;
        // The key whose value begins here, if any.
        let before = text[..at].rsplit('\n').next().unwrap_or_default();
        match before.split_once('=') {
            Some((key, _)) => format!("line {line}: {}: ", key.trim()),
            None => culprit(text, line, fits).unwrap_or_else(|| format!("line {line}: ")),
        }
    });
    let hint = match message.contains("escape") || message.contains("unicode") {
        true => ": in double quotes \\ begins an escape: write / in paths, or put them in single quotes"
            .to_owned(),
        false => nearest(&message),
    };
    format!("{place}{message}{hint}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct File {
        #[serde(rename = "radius_mm")]
        _radius_mm: f64,
        #[serde(rename = "method")]
        _method: Tagged,
    }

    /// Tagged enums are deserialised twice, and the second time without locations.
    #[derive(Debug, serde::Deserialize)]
    #[serde(tag = "name")]
    enum Tagged {
        #[serde(rename = "a")]
        A {
            #[serde(default, rename = "element_mm")]
            _element_mm: f64,
        },
    }

    #[test]
    fn a_value_of_the_wrong_type_is_named_by_line_and_key() {
        let good = "radius_mm = 1.0\n[method]\n# comment\nname = \"a\"\nelement_mm = 2.0\n";
        assert!(parse_toml::<File>(good, Path::new("f.toml")).is_ok());
        for (from, to, start) in [
            ("1.0", "\"x\"", "f.toml: line 1: radius_mm: must be a number, not the text \"x\""),
            ("2.0", "true", "f.toml: line 5: element_mm: must be a number, not true"),
            ("\"a\"", "5", "f.toml: line 4: name: must be a name, not 5"),
        ] {
            let text = good.replace(from, to);
            let message = parse_toml::<File>(&text, Path::new("f.toml")).unwrap_err().to_string();
            assert!(message.starts_with(start), "{message}");
        }
    }

    #[derive(Debug, PartialEq, serde::Deserialize)]
    struct Lists {
        place_mm: Option<[f64; 3]>,
        #[serde(default)]
        pairs: Vec<(u32, [u8; 2])>,
        #[serde(default)]
        choice: Choice,
        any: Option<toml::Value>,
    }

    #[derive(Debug, Default, PartialEq, serde::Deserialize)]
    #[serde(rename_all = "snake_case")]
    enum Choice {
        #[default]
        None,
        Within([f64; 2]),
        Around {
            centre_mm: [f64; 2],
        },
    }

    #[test]
    fn a_list_that_is_longer_than_it_may_be_is_named_by_line_and_key() {
        let read = |text: &str| parse_toml::<Lists>(text, Path::new("f.toml")).map_err(|e| e.to_string());
        let good = "place_mm = [1, 2.0, 3]\npairs = [[1, [2, 3]], [4, [5, 6]]]\nany = [[1], 1979-05-27]\n";
        let lists = read(good).unwrap();
        assert_eq!(lists.place_mm, Some([1.0, 2.0, 3.0]));
        assert_eq!(lists.pairs, [(1, [2, 3]), (4, [5, 6])]);
        assert!(lists.any.is_some_and(|any| any[1].is_datetime() && any[0][0].as_integer() == Some(1)));
        for (text, reported) in [
            ("place_mm = [1, 2, 3, 4]", "f.toml: line 1: place_mm: must be a list of 3, not of 4"),
            ("place_mm = [1, 2]", "f.toml: line 1: place_mm: must be a list of 3, not of 2"),
            ("\npairs = [[1, [2, 3, 4, 5]]]", "f.toml: line 2: pairs: must be a list of 2, not of 4"),
            ("pairs = [[1, [2, 3], 4]]", "f.toml: line 1: pairs: must be a list of 2, not of 3"),
            ("choice = { within = [1, 2, 3] }", "must be a list of 2, not of 3"),
            (
                "[choice.around]\ncentre_mm = [1, 2, 3]",
                "f.toml: line 2: centre_mm: must be a list of 2, not of 3",
            ),
        ] {
            let message = read(text).unwrap_err();
            assert!(message.contains(reported), "{message}");
        }
    }
}
