fn main() {
    for f in endowire_verify::FAMILIES {
        for r in f.run() {
            if !r.pass {
                println!("{:?}", r);
            }
        }
    }
}
