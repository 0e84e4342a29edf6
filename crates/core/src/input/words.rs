//! What serde says of values of the wrong type, in the words of a file's reader.

/// The types that serde and derived readers expect, and what a reader of the message calls them.
const EXPECTED: [(&str, &str); 24] = [
    ("f64", "a number"),
    ("f32", "a number"),
    ("u8", "a whole number from 0 to 255"),
    ("u16", "a whole number from 0 to 65535"),
    ("u32", "a whole number, 0 or more"),
    ("u64", "a whole number, 0 or more"),
    ("usize", "a whole number, 0 or more"),
    ("i8", "a whole number from -128 to 127"),
    ("i16", "a whole number from -32768 to 32767"),
    ("i32", "a whole number"),
    ("i64", "a whole number"),
    ("isize", "a whole number"),
    ("a nonzero u32", "a whole number above 0"),
    ("a nonzero u64", "a whole number above 0"),
    ("a nonzero usize", "a whole number above 0"),
    ("a boolean", "true or false"),
    ("a string", "text"),
    ("a borrowed string", "text"),
    ("path string", "the name of a file"),
    ("a sequence", "a list"),
    ("a map", "a table"),
    ("variant identifier", "a name"),
    ("string or table", "a name"),
    ("string only", "a name"),
];

/// Beginnings of what serde calls a table; the name of its type follows.
const TABLES: [&str; 3] = ["struct ", "internally tagged enum ", "adjacently tagged enum "];

/// Beginnings of what serde calls a choice between names; the name of its type follows.
const CHOICES: [&str; 2] = ["enum ", "unit variant "];

/// A message of serde in plain words: what the value must be, and what was given. Messages of other kinds are as
/// they were.
pub fn plain(message: &str) -> String {
    // A reader of JSON says the place at the end.
    let (reported, place) = match message.rfind(" at line ") {
        Some(at) => message.split_at(at),
        None => (message, ""),
    };
    let words = of_type(reported).or_else(|| of_length(reported)).or_else(|| of_key(reported));
    words.map_or_else(|| message.to_owned(), |words| format!("{words}{place}"))
}

/// "invalid type: string "x", expected f64", and the same of a value.
fn of_type(message: &str) -> Option<String> {
    let rest = message.strip_prefix("invalid type: ").or_else(|| message.strip_prefix("invalid value: "))?;
    // The text that was given may say "expected" too.
    let (given, expected) = rest.rsplit_once(", expected ")?;
    Some(format!("must be {}, not {}", wanted(expected), found(given)))
}

/// "invalid length 2, expected an array of length 3".
fn of_length(message: &str) -> Option<String> {
    let (count, expected) = message.strip_prefix("invalid length ")?.split_once(", expected ")?;
    count.parse::<usize>().ok()?;
    Some(format!("must be {}, not of {count}", wanted(expected)))
}

/// "missing field `x`", "unknown variant `x`, expected one of `a`, `b`", and a value that fits no form of a key.
fn of_key(message: &str) -> Option<String> {
    if let Some(key) = message.strip_prefix("missing field ") {
        return Some(format!("the key {key} is missing"));
    }
    if let Some(rest) = message.strip_prefix("unknown variant ") {
        return Some(format!("unknown name {rest}"));
    }
    message
        .starts_with("data did not match any variant of untagged enum ")
        .then(|| "fits none of the forms that the key has".to_owned())
}

/// What was expected.
fn wanted(expected: &str) -> String {
    if let Some((_, words)) = EXPECTED.iter().find(|(name, _)| *name == expected) {
        return (*words).to_owned();
    }
    for of_list in ["an array of length ", "a tuple of size "] {
        if let Some(count) = expected.strip_prefix(of_list) {
            return format!("a list of {count}");
        }
    }
    if let Some((_, count)) = expected.split_once(" with ")
        && (expected.starts_with("tuple ") || expected.starts_with("struct "))
        && let Some(count) = count.strip_suffix(" elements").or_else(|| count.strip_suffix(" element"))
    {
        return format!("a list of {count}");
    }
    if TABLES.iter().any(|table| expected.starts_with(table)) {
        return "a table of keys and values".to_owned();
    }
    if CHOICES.iter().any(|choice| expected.starts_with(choice)) {
        return "a name".to_owned();
    }
    expected.to_owned()
}

/// What was given.
fn found(given: &str) -> String {
    let bare = |text: &str| text.trim_matches('`').to_owned();
    if let Some(text) = given.strip_prefix("string ") {
        return format!("the text {text}");
    }
    for number in ["integer ", "floating point ", "boolean "] {
        if let Some(value) = given.strip_prefix(number) {
            return bare(value);
        }
    }
    match given {
        "sequence" => "a list",
        "map" => "a table",
        "null" | "unit value" | "Option value" => "nothing",
        other => other,
    }
    .to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_of_serde_is_said_in_plain_words() {
        for (serde, reported) in [
            ("invalid type: string \"x\", expected f64", "must be a number, not the text \"x\""),
            (
                "invalid type: floating point `1.5`, expected usize",
                "must be a whole number, 0 or more, not 1.5",
            ),
            ("invalid value: integer `-2`, expected u64", "must be a whole number, 0 or more, not -2"),
            ("invalid value: integer `300`, expected u8", "must be a whole number from 0 to 255, not 300"),
            ("invalid type: boolean `true`, expected a string", "must be text, not true"),
            (
                "invalid type: sequence, expected struct Wall",
                "must be a table of keys and values, not a list",
            ),
            ("invalid type: map, expected f64", "must be a number, not a table"),
            ("invalid type: null, expected a boolean", "must be true or false, not nothing"),
            ("invalid length 2, expected an array of length 3", "must be a list of 3, not of 2"),
            ("invalid length 4, expected a list of 3", "must be a list of 3, not of 4"),
            ("invalid length 1, expected tuple struct Pair with 2 elements", "must be a list of 2, not of 1"),
            (
                "invalid type: string \"a, expected b\", expected f64 at line 1 column 5",
                "must be a number, not the text \"a, expected b\" at line 1 column 5",
            ),
            ("missing field `radius_mm`", "the key `radius_mm` is missing"),
            ("unknown variant `x`, expected `a` or `b`", "unknown name `x`, expected `a` or `b`"),
            ("unknown field `x`, expected `a`", "unknown field `x`, expected `a`"),
            ("must be above 0", "must be above 0"),
        ] {
            assert_eq!(plain(serde), reported);
        }
    }

    /// A table with a key of every type that files have.
    #[derive(Debug, serde::Deserialize)]
    struct Every {
        #[serde(rename = "number")]
        _number: Option<f64>,
        #[serde(rename = "count")]
        _count: Option<usize>,
        #[serde(rename = "text")]
        _text: Option<String>,
        #[serde(rename = "yes")]
        _yes: Option<bool>,
        #[serde(rename = "place")]
        _place: Option<[f64; 3]>,
        #[serde(rename = "pair")]
        _pair: Option<(f64, f64)>,
        #[serde(rename = "all")]
        _all: Option<Vec<f64>>,
        #[serde(rename = "file")]
        _file: Option<std::path::PathBuf>,
        #[serde(rename = "table")]
        _table: Option<Box<Every>>,
        #[serde(rename = "choice")]
        _choice: Option<Choice>,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(rename_all = "snake_case")]
    enum Choice {
        One,
    }

    #[test]
    fn no_message_about_a_file_names_a_type_of_the_program() {
        let values = ["\"x\"", "1", "-1", "1.5", "true", "[1]", "[\"x\"]", "{ a = 1 }", "1979-05-27"];
        let keys = ["number", "count", "text", "yes", "place", "pair", "all", "file", "table", "choice"];
        for (key, value) in keys.iter().flat_map(|key| values.map(|value| (key, value))) {
            let text = format!("{key} = {value}");
            if let Err(error) = super::super::parse_toml::<Every>(&text, std::path::Path::new("f.toml")) {
                let reported = error.to_string();
                let bad = [
                    "f64", "usize", "u64", "i64", "struct", "enum", "variant", "sequence", " map", "invalid",
                ];
                assert!(!bad.iter().any(|word| reported.contains(word)), "{text}: {reported}");
            }
        }
    }
}
