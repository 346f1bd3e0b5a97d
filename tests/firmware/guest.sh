#!/bin/bash
# SPDX-License-Identifier: MIT
# guest.sh DIR KERNEL-DEB FILE...: a folder DIR with `vmlinuz` and `initramfs.cpio`: Debian's own kernel, its
# CAN modules, busybox, can-utils, iproute2, and the FILEs (programs with the libraries they need) in /test,
# whose script /test/guest_init.sh is run. DIR/kernel is kept for the next time.
set -e
dir=$1 deb=$2; shift 2
mkdir -p "$dir"
if [ ! -e "$dir/kernel/unpacked" ] || [ "$(cat "$dir/kernel/unpacked")" != "$(basename "$deb")" ]; then
  rm -rf "$dir/kernel"; mkdir -p "$dir/kernel"
  dpkg -x "$deb" "$dir/kernel"
  basename "$deb" > "$dir/kernel/unpacked"
fi
# Unpacked, where it is packed with xz: that is a sixth of what the emulated processor would do.
python3 - "$dir"/kernel/boot/vmlinuz-* "$dir/vmlinuz" << 'END'
import lzma
import sys
packed = open(sys.argv[1], "rb").read()
at = packed.find(b"\xfd7zXZ\0")
kernel = packed
if at >= 0:
    try:
        kernel = lzma.LZMADecompressor().decompress(packed[at:])
    except lzma.LZMAError:
        pass
is_program = kernel[:4] == b"\x7fELF" and b"Xen\0" in kernel  # with an entry that QEMU knows
open(sys.argv[2], "wb").write(kernel if is_program else packed)
END
root=$dir/root
rm -rf "$root"
mkdir -p "$root"/{bin,tools,proc,sys,dev,tmp,modules,test,etc}
cp "$(command -v busybox)" "$root/bin/busybox"

# A program and what the loader needs for it.
add() { # FILE FOLDER
  cp "$1" "$root/$2/"
  { ldd "$1" 2> /dev/null || true; } | grep -o '/[^ ]*' | while read -r library; do
    mkdir -p "$root$(dirname "$library")"
    [ -e "$root$library" ] || cp -L "$library" "$root$library"
  done
}
for program in candump cansend canplayer cangen isotprecv ip tc; do add "$(command -v $program)" tools; done
for file in "$@"; do
  add "$file" test
  case $file in */rim | */rimd) strip -o "$root/test/$(basename "$file")" "$file" ;; esac
done
for module in can can-raw can-dev can-isotp vcan sja1000 kvaser_pci sch_tbf; do
  find "$dir/kernel/lib/modules" -name "$module.ko*" -exec cp {} "$root/modules/" \;
done
[ "$(ls "$root/modules" | wc -l)" = 8 ] || { echo "guest: the kernel package lacks a CAN module" >&2; exit 1; }
cat > "$root/init" << 'END'
#!/bin/busybox sh
/bin/busybox --install -s /bin
export PATH=/tools:/bin
mount -t proc proc /proc; mount -t sysfs sys /sys; mount -t devtmpfs dev /dev
for m in can can-raw can-dev can-isotp vcan sja1000 kvaser_pci sch_tbf; do insmod /modules/$m.ko || echo "no module $m"; done
cd /test && sh /test/guest_init.sh
poweroff -f
END
chmod +x "$root/init"
(cd "$root" && find . | cpio -o -H newc --quiet) > "$dir/initramfs.cpio"
