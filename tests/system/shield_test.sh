# The rule of scripts/setup.sh shield: crafted fragments do not reach LCM, sound messages do, small and large ones.
source "$(dirname "$0")/lib.sh"
multicast
if ! nft list ruleset >/dev/null 2>&1; then echo "SKIPPED: there is no nft, or this kernel has no nf_tables"; exit $SKIPPED; fi
url="udpm://239.255.76.67:23451?ttl=0&recv_buf_size=4194304"
cat >"$work/attack.py" <<'PYTHON'
import socket, struct, sys
s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
s.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
def fragment(number, size, offset, index, count, data):
    s.sendto(b"LC03" + struct.pack(">IIIHH", number, size, offset, index, count) + data, ("239.255.76.67", 23451))
channel = b"DMSLAM_PLAYER_CAMERA_INFO\0"
for number in range(1, 20):  # the second one's place lies far outside of the message, whose end wraps around
    fragment(number, 5000, 0, 0, 3, channel + bytes(1000))
    fragment(number, 5000, 0xFFFFFF00, 1, 3, bytes(1000))
    fragment(number + 100, 0xFFFFFFF0, 0, 0, 3, channel + bytes(1000))
PYTHON
begin() { # a process that hears the channel; in $pid
  "$build/bin/dmslam-collector" --lcm-url "$url" --session 7 --fresh-system --out "$work/out" >"$work/log" 2>&1 </dev/null &
  pid=$!
  for ((i = 0; i < 200; ++i)); do grep -qi ":$(printf %04X 23451) " /proc/net/udp && break; sleep 0.05; done
  sleep 0.5
}
begin
python3 "$work/attack.py"
sleep 1
kill -0 "$pid" 2>/dev/null && echo "without the shield the process survives here: this LCM checks its fragments"
kill -KILL "$pid" 2>/dev/null
wait "$pid" 2>/dev/null

check "the shield is loaded" "$root/scripts/setup.sh" shield
check "it may be loaded again" "$root/scripts/setup.sh" shield
begin
python3 "$work/attack.py"
sleep 1
check "behind the shield the process survives" kill -0 "$pid"
kill -KILL "$pid" 2>/dev/null
wait "$pid" 2>/dev/null
dropped() { nft list table inet dmslam_shield | sed -nE "s/.*counter packets ([0-9]+) .*$1.*/\1/p"; }
(($(dropped "too large") == 19)) || failed "the rule counts $(dropped "too large") fragments that claim too much"
(($(dropped "outside") == 19)) || failed "the rule counts $(dropped "outside") fragments that lie outside"

# A run is as it was: frames of 300 KB are many fragments each.
need_synthetic
run --sequence "$synthetic" --camera "$root/config/synthetic.yaml" --frames 20 --lockstep --encoding raw --out "$work/run" >"$work/said" 2>&1
no_orphans "the run"
check "frames came through the shield" grep -qE '"frames_received": 20' "$work/run/summary.json"
(($(dropped "too large") == 19)) || failed "the shield drops sound messages"
finish
