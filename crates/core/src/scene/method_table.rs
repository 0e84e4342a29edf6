//! `[method]` without a name: options of the method that a scene has without the table.

use std::fmt;
use std::marker::PhantomData;

use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, StrDeserializer, StringDeserializer};
use serde::de::{DeserializeSeed, Deserializer, MapAccess, Visitor};

use crate::methods::MethodChoice;

/// The key that names the method.
const NAME: &str = "name";

/// Reads the table, adding the name of the default method if it has none.
pub(super) fn read<'de, M, D>(reader: D) -> Result<M, D::Error>
where
    M: MethodChoice + Deserialize<'de> + Default,
    D: Deserializer<'de>,
{
    reader.deserialize_map(Table(PhantomData))
}

struct Table<M>(PhantomData<M>);

impl<'de, M: MethodChoice + Deserialize<'de> + Default> Visitor<'de> for Table<M> {
    type Value = M;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table with the name of a method and its options")
    }

    fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<M, A::Error> {
        let named = Named { table, missing: Some(M::default().name()), ended: false };
        M::deserialize(MapAccessDeserializer::new(named))
    }
}

/// A table, with a name appended if it has none.
struct Named<A> {
    table: A,
    /// The name, until one has been read.
    missing: Option<&'static str>,
    /// Whether the end of the table has been reached.
    ended: bool,
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Named<A> {
    type Error = A::Error;

    fn next_key_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, A::Error> {
        if let Some(key) = self.table.next_key::<String>()? {
            self.missing = self.missing.filter(|_| key != NAME);
            return seed.deserialize(StringDeserializer::new(key)).map(Some);
        }
        self.ended = true;
        self.missing.map(|_| seed.deserialize(StrDeserializer::new(NAME))).transpose()
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, A::Error> {
        match self.missing.take_if(|_| self.ended) {
            Some(name) => seed.deserialize(StrDeserializer::new(name)),
            None => self.table.next_value_seed(seed),
        }
    }
}
