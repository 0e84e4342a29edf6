//! Checks all numbers of a state that comes from elsewhere. A seal tells whether a file is whole, not whether its
//! numbers are those of an insertion; each of them may be compared, clamped or divided by.

use std::fmt::{self, Display};

use serde::ser::{self, Serialize};

/// Where a number is not finite, innermost key last; empty in a list or a map without keys.
#[derive(Debug)]
pub(super) struct NotFinite(String);

impl NotFinite {
    fn within(self, key: &str) -> Self {
        if self.0.is_empty() { Self(key.to_owned()) } else { Self(format!("{key}.{}", self.0)) }
    }

    /// The keys that lead to it.
    pub(super) fn path(&self) -> &str {
        &self.0
    }
}

impl Display for NotFinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is not a finite number", self.0)
    }
}

impl std::error::Error for NotFinite {}

impl ser::Error for NotFinite {
    fn custom<T: Display>(text: T) -> Self {
        Self(text.to_string())
    }
}

/// Checks that all numbers of a value are finite.
///
/// # Errors
/// The place of the first that is not.
pub(super) fn check(value: &impl Serialize) -> Result<(), NotFinite> {
    value.serialize(Walk)
}

/// Goes through a value and writes nothing.
#[derive(Clone, Copy)]
struct Walk;

type Seen = Result<(), NotFinite>;

/// Whatever is no floating-point number.
macro_rules! passes {
    ($($name:ident: $kind:ty),*) => {
        $(fn $name(self, _: $kind) -> Seen { Ok(()) })*
    };
}

impl ser::Serializer for Walk {
    type Ok = ();
    type Error = NotFinite;
    type SerializeSeq = Self;
    type SerializeTuple = Self;
    type SerializeTupleStruct = Self;
    type SerializeTupleVariant = Self;
    type SerializeMap = Self;
    type SerializeStruct = Self;
    type SerializeStructVariant = Self;

    passes!(serialize_bool: bool, serialize_i8: i8, serialize_i16: i16, serialize_i32: i32, serialize_i64: i64,
            serialize_u8: u8, serialize_u16: u16, serialize_u32: u32, serialize_u64: u64, serialize_char: char,
            serialize_str: &str, serialize_bytes: &[u8], serialize_unit_struct: &'static str);

    fn serialize_f32(self, number: f32) -> Seen {
        self.serialize_f64(f64::from(number))
    }

    fn serialize_f64(self, number: f64) -> Seen {
        if number.is_finite() { Ok(()) } else { Err(NotFinite(String::new())) }
    }

    fn serialize_none(self) -> Seen {
        Ok(())
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Seen {
        value.serialize(self)
    }

    fn serialize_unit(self) -> Seen {
        Ok(())
    }

    fn serialize_unit_variant(self, _: &'static str, _: u32, _: &'static str) -> Seen {
        Ok(())
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(self, _: &'static str, value: &T) -> Seen {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        value: &T,
    ) -> Seen {
        value.serialize(self)
    }

    fn serialize_seq(self, _: Option<usize>) -> Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_tuple(self, _: usize) -> Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_tuple_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_map(self, _: Option<usize>) -> Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_struct_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self, NotFinite> {
        Ok(self)
    }
}

/// Lists, whose members have no keys.
macro_rules! walks {
    ($($kind:ident.$method:ident),*) => {
        $(impl ser::$kind for Walk {
            type Ok = ();
            type Error = NotFinite;

            fn $method<T: Serialize + ?Sized>(&mut self, value: &T) -> Seen {
                value.serialize(*self)
            }

            fn end(self) -> Seen {
                Ok(())
            }
        })*
    };
}

walks!(
    SerializeSeq.serialize_element,
    SerializeTuple.serialize_element,
    SerializeTupleStruct.serialize_field,
    SerializeTupleVariant.serialize_field
);

/// Members with keys.
macro_rules! walks_keys {
    ($($kind:ident),*) => {
        $(impl ser::$kind for Walk {
            type Ok = ();
            type Error = NotFinite;

            fn serialize_field<T: Serialize + ?Sized>(&mut self, key: &'static str, value: &T) -> Seen {
                value.serialize(*self).map_err(|error| error.within(key))
            }

            fn end(self) -> Seen {
                Ok(())
            }
        })*
    };
}

walks_keys!(SerializeStruct, SerializeStructVariant);

impl ser::SerializeMap for Walk {
    type Ok = ();
    type Error = NotFinite;

    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Seen {
        key.serialize(*self)
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Seen {
        value.serialize(*self)
    }

    fn end(self) -> Seen {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(serde::Serialize)]
    struct Report {
        force_n: Option<f64>,
        places_mm: Vec<[f64; 3]>,
    }

    #[test]
    fn a_number_that_is_not_finite_is_found_wherever_it_is() {
        let of = |force_n, x| {
            check(&(1, Report { force_n, places_mm: vec![[0.0; 3], [0.0, x, 1.0]] }))
                .map_err(|e| e.path().to_owned())
        };
        assert_eq!(of(Some(1.0), 2.0), Ok(()));
        assert_eq!(of(None, f64::NAN), Err("places_mm".to_owned()));
        assert_eq!(of(Some(f64::INFINITY), 2.0), Err("force_n".to_owned()));
    }
}
