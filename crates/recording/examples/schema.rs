//! Prints the JSON schema of recordings, `crates/recording/recording.schema.json`.

fn main() -> serde_json::Result<()> {
    println!("{}", serde_json::to_string_pretty(&endowire_recording::schema::document())?);
    Ok(())
}
