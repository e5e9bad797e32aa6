# Processes are killed during a run: it goes on where it was, and nothing that was accepted is lost.
source "$(dirname "$0")/lib.sh"
multicast
if [[ -d $data/kitchen ]]; then
  sequence=$data/kitchen camera=$root/config/kitchen.yaml frames=200 tracked=75
else
  need_synthetic
  sequence=$synthetic camera=$root/config/synthetic.yaml frames=150 tracked=40
fi
check "killed processes go on" "$root/scripts/kill_test.sh" --sequence "$sequence" --camera "$camera" --frames "$frames" \
  --kills 2 --victims frontend,mapper,loopcloser --min-tracked "$tracked" --out "$work/kills" --build-dir "$build"
finish
