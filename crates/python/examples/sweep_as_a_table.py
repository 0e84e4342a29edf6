"""Run one scene with many values of its keys, on all cores, and read the table. A killed sweep goes on.

The table is Parquet: `pandas.read_parquet(table)`, or pyarrow as here, if it is there.
"""

from importlib.util import find_spec
from pathlib import Path

import endowire

Path("sweep.toml").write_text(f"""
scene = "{(endowire.assets_path() / "scenes" / "arch_subclavian.toml").as_posix()}"
samples = 2
[set]
"method.element_mm" = 5.0
"script[1].step_mm" = 5.0
[[axis]]
key = "vessel.wall.friction"
list = [0.0, 0.2]
[[axis]]
key = "vessel.wall.modulus_n_per_mm2"
latin = {{ from = 0.1, to = 10.0, log = true }}
""")
done = endowire.sweep("sweep.toml", "swept")
print(f"{done['runs']} runs, {done['failed']} failed, table {done['table']}")
if find_spec("pyarrow"):
    from pyarrow import parquet

    for row in parquet.read_table(done["table"]).to_pylist():
        print(row["vessel.wall.friction"], row["vessel.wall.modulus_n_per_mm2"], row["max_push_force_n"])
