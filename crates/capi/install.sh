#!/usr/bin/env bash
# Installs the C interface: header, shared and static library, and what pkg-config and CMake need to find them.
#
#     crates/capi/install.sh PREFIX                (include, lib, lib/pkgconfig and lib/cmake/Endowire in that folder)
#     PROFILE=dist crates/capi/install.sh PREFIX   (another profile of cargo than release)
#     FROM=FOLDER crates/capi/install.sh PREFIX    (libraries that are built already)
#
# Needs cargo and a C compiler. What is installed may be moved as a whole: nothing in it names the prefix.
set -euo pipefail
if [ $# -ne 1 ]; then
  echo "usage: crates/capi/install.sh PREFIX" >&2
  exit 2
fi
mkdir -p "$1"
prefix=$(cd "$1" && pwd)
from=${FROM:+$(cd "$FROM" && pwd)}
cd "$(dirname "$0")"

if [ -z "$from" ]; then
  profile=${PROFILE:-release}
  (cd ../.. && cargo build --locked --profile "$profile" -p endowire-capi)
  from=${CARGO_TARGET_DIR:-../../target}/$([ "$profile" = dev ] && echo debug || echo "$profile")
fi

# What programs that take the static library link with, by rustc --print native-static-libs.
case $(uname -s) in
  Darwin) shared=libendowire_c.dylib system="-lSystem -lc -lm" ;;
  *) shared=libendowire_c.so system="-lgcc_s -lutil -lrt -lpthread -lm -ldl -lc" ;;
esac
static=libendowire_c.a
version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' ../../Cargo.toml)

install -d "$prefix/include" "$prefix/lib/pkgconfig" "$prefix/lib/cmake/Endowire"
install -m 644 include/endowire.h "$prefix/include"
install -m 755 "$from/$shared" "$prefix/lib"
install -m 644 "$from/$static" "$prefix/lib"
if [ "$(uname -s)" = Darwin ]; then
  # Otherwise programs would look for it where it was built.
  install_name_tool -id "@rpath/$shared" "$prefix/lib/$shared"
else
  # Tables for debuggers are most of what is in them.
  strip --strip-unneeded "$prefix/lib/$shared"
  strip --strip-debug "$prefix/lib/$static"
fi
filled() {
  sed -e "s/@VERSION@/$version/" -e "s/@SHARED@/$shared/" -e "s/@STATIC@/$static/" -e "s/@SYSTEM@/$system/" "$1" >"$2"
}
filled endowire.pc.in "$prefix/lib/pkgconfig/endowire.pc"
filled EndowireConfig.cmake.in "$prefix/lib/cmake/Endowire/EndowireConfig.cmake"
filled EndowireConfigVersion.cmake.in "$prefix/lib/cmake/Endowire/EndowireConfigVersion.cmake"
(cd "$prefix" && du -h "include/endowire.h" "lib/$shared" "lib/$static")
