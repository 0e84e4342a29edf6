//! The protocol on a socket. A client must send as first line a token that is printed only by this call. Web pages
//! can send requests to any port of the machine on which they are shown, and so can its other users; they do not know
//! the token.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::{IpAddr, Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::path::{Component, Path, PathBuf};
use std::str::FromStr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::lines::{self, Line, Order};
use super::live::Message;
use crate::failure::Failure;
use crate::output::tell;

/// Random bytes of a token: too many to guess.
const TOKEN_BYTES: usize = 16;
/// Length limit of the first line, bytes: the token as hexadecimal digits and a line break.
const LONGEST_TOKEN: u64 = 2 * TOKEN_BYTES as u64 + 2;
/// Largest number of simultaneous connections that have sent the token, and of those that have not yet.
const MOST: usize = 64;
/// Time limit for sending the token. Each connection occupies a thread.
const PATIENCE: Duration = Duration::from_secs(5);

/// The address of `--listen`: a port of this machine, or a full address.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Address(SocketAddr);

impl FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let port = text.parse().map(|port| SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port));
        let address = port.or_else(|_| text.parse());
        address
            .map(Self)
            .map_err(|_| "give a port, such as 7000, or an address, such as 127.0.0.1:7000".to_owned())
    }
}

impl Address {
    /// The address, if it is reachable only from this machine or `remote` is set.
    pub(super) fn allowed(self, remote: bool) -> Result<SocketAddr, Failure> {
        if self.0.ip().is_loopback() || remote {
            return Ok(self.0);
        }
        Err(Failure::Input(format!(
            "--listen {}: other machines reach this address, and what goes over it can be read on its way: give a port alone, which \
             listens on this machine, or --allow-remote if that is meant",
            self.0
        )))
    }
}

/// Accepts lines from clients that know the token. They may write pictures only into `folder`.
pub(super) fn listen(address: SocketAddr, folder: &Path, to: &Sender<Message>) -> Result<(), Failure> {
    let failed = |e: io::Error| Failure::Input(format!("--listen {address}: {e}"));
    std::fs::create_dir_all(folder).map_err(|e| Failure::write(folder, &e))?;
    let token = token().map_err(failed)?;
    let listener = TcpListener::bind(address).map_err(failed)?;
    tell(format_args!("endowire: listens at {}", listener.local_addr().map_err(failed)?));
    tell(format_args!("endowire: the first line of a connection is {token}"));
    let (token, folder, to): (Arc<str>, Arc<Path>, _) = (token.into(), folder.into(), to.clone());
    let silent = Arc::new(Silent::default());
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let (token, folder, to) = (Arc::clone(&token), Arc::clone(&folder), to.clone());
            let waiting = silent.add(&stream);
            // A connection without a thread is closed.
            let _ = std::thread::Builder::new()
                .spawn(move || waiting.map(|waiting| serve(stream, waiting, &token, &folder, &to)));
        }
    });
    Ok(())
}

/// Connections that have not sent the token yet, oldest first. Beyond the limit the oldest is closed, so that clients
/// who say nothing keep nobody out.
#[derive(Default)]
struct Silent {
    streams: Mutex<VecDeque<(u64, TcpStream)>>,
    /// Number of all connections so far.
    count: AtomicU64,
    /// Those that have sent it, each with a clone.
    open: Arc<()>,
}

/// A connection among the silent ones.
struct Waiting {
    silent: Arc<Silent>,
    number: u64,
}

impl Silent {
    fn add(self: &Arc<Self>, stream: &TcpStream) -> io::Result<Waiting> {
        let mut streams = self.streams.lock().unwrap_or_else(PoisonError::into_inner);
        if streams.len() >= MOST
            && let Some((_, oldest)) = streams.pop_front()
        {
            let _ = oldest.shutdown(Shutdown::Both);
        }
        let number = self.count.fetch_add(1, Ordering::Relaxed);
        streams.push_back((number, stream.try_clone()?));
        Ok(Waiting { silent: Arc::clone(self), number })
    }
}

impl Waiting {
    /// It has sent the token: a place among those who have, if one is free.
    fn opens(self) -> Option<Arc<()>> {
        let place = Arc::clone(&self.silent.open);
        // One is that of the list.
        (Arc::strong_count(&place) <= MOST + 1).then_some(place)
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        let mut streams = self.silent.streams.lock().unwrap_or_else(PoisonError::into_inner);
        streams.retain(|(number, _)| *number != self.number);
    }
}

fn token() -> io::Result<String> {
    let mut bytes = [0; TOKEN_BYTES];
    getrandom::fill(&mut bytes)?;
    Ok(bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing into a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    }))
}

/// Answers one client until it disconnects; the session continues.
fn serve(stream: TcpStream, waiting: Waiting, token: &str, folder: &Path, to: &Sender<Message>) {
    let Ok(mut back) = stream.try_clone() else { return };
    let mut lines = BufReader::new(stream);
    // One packet per line: several small writes would be delayed by about 0.05 s.
    let mut answer = |line: &str| back.write_all(format!("{line}\n").as_bytes()).is_ok();
    match opened(&mut lines, token) {
        Ok(true) => match waiting.opens() {
            Some(_place) => lines::read(lines, to, |line| confined(line, folder), answer),
            None => {
                let error = format!("{MOST} clients are connected: close one of them");
                answer(&serde_json::json!({ "ok": false, "error": error }).to_string());
            }
        },
        Ok(false) => {
            let error =
                "the first line must be the token that endowire play has printed on its standard error";
            answer(&serde_json::json!({ "ok": false, "error": error }).to_string());
        }
        // A client that sends nothing gets no answer.
        Err(_) => {}
    }
}

/// Whether the first line is the token.
fn opened(lines: &mut BufReader<TcpStream>, token: &str) -> io::Result<bool> {
    let stream = lines.get_ref();
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    let mut first = Vec::new();
    lines.by_ref().take(LONGEST_TOKEN).read_until(b'\n', &mut first)?;
    lines.get_ref().set_read_timeout(None)?;
    Ok(first.trim_ascii_end() == token.as_bytes())
}

/// Restricts a line of a client: its pictures have bare names, and lie in the session's folder.
fn confined(line: Line, folder: &Path) -> Result<Line, String> {
    match line {
        Line::Order(Order::Picture { file, window }) => {
            let file = inside(&file, folder)?;
            Ok(Line::Order(Order::Picture { file, window }))
        }
        line => Ok(line),
    }
}

/// Path of a picture with this name in a folder.
fn inside(file: &Path, folder: &Path) -> Result<PathBuf, String> {
    let refused = |what: &str| format!("picture: file = {:?}: {what}", file.display().to_string());
    let mut parts = file.components();
    let is_name = matches!((parts.next(), parts.next()), (Some(Component::Normal(_)), None));
    if !is_name || file.extension().is_none_or(|ending| ending != "png") {
        return Err(refused(
            "over a socket it must be a name alone that ends in .png; it goes into the session's folder",
        ));
    }
    let path = folder.join(file);
    match path.symlink_metadata() {
        Ok(there) if !there.is_file() => Err(refused("is there and no file: give another name")),
        _ => Ok(path),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_stays_in_its_folder() {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| inside(Path::new(name), folder.path());
        assert_eq!(place("seen.png").unwrap(), folder.path().join("seen.png"));
        std::fs::create_dir(folder.path().join("dir.png")).unwrap();
        for name in
            ["/tmp/seen.png", "../seen.png", "a/seen.png", "..", ".", "", "played.toml", ".png", "dir.png"]
        {
            assert!(place(name).is_err(), "{name}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("/tmp/elsewhere.png", folder.path().join("link.png")).unwrap();
            assert!(place("link.png").is_err());
        }
    }

    #[test]
    fn silent_connections_keep_nobody_out() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let silent = Arc::new(Silent::default());
        let mut ends: Vec<(TcpStream, TcpStream, Waiting)> = Vec::new();
        for _ in 0..MOST + 1 {
            let client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
            let (stream, _) = listener.accept().unwrap();
            let waiting = silent.add(&stream).unwrap();
            ends.push((client, stream, waiting));
        }
        // The oldest is closed, the newest waits and gets a place.
        assert_eq!(ends[0].0.read(&mut [0]).unwrap(), 0);
        ends[1].0.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
        assert!(ends[1].0.read(&mut [0]).is_err(), "the twin");
        assert_eq!(silent.streams.lock().unwrap().len(), MOST);
        let places: Vec<_> = ends.into_iter().map(|(.., waiting)| waiting.opens()).collect();
        assert!(places[..MOST].iter().all(Option::is_some) && places[MOST].is_none());
        assert!(silent.streams.lock().unwrap().is_empty());
    }

    #[test]
    fn other_machines_reach_it_only_where_that_is_said() {
        let address = |text: &str| text.parse::<Address>().unwrap();
        assert!(address("7000").allowed(false).unwrap().ip().is_loopback());
        assert!(address("[::1]:7000").allowed(false).is_ok());
        assert!(address("0.0.0.0:7000").allowed(false).is_err());
        assert!(address("0.0.0.0:7000").allowed(true).is_ok(), "the twin");
        assert!("somewhere".parse::<Address>().is_err());
    }
}
