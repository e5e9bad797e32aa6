# Processes that were not told their session: the first camera's player draws one, all others ask the bus for it, those of a
# further camera too, and of two none is guessed. Who was told of too few cameras is told.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
url="udpm://239.255.76.67:23493?ttl=0&recv_buf_size=4194304"
camera=(--camera "$root/config/synthetic.yaml" --sequence "$synthetic")
begin() { # LOG PROCESS ARGUMENTS...
  "$build/bin/dmslam-$2" --lcm-url "$url" "${@:3}" >"$work/$1.log" 2>&1 </dev/null &
}
ended() { # LOG CODE COMMAND...
  local status=0
  timeout 30 "$build/bin/dmslam-$3" --lcm-url "$url" "${@:4}" >"$work/$1.log" 2>&1 </dev/null || status=$?
  check "$1 ends with $2, not $status: $(<"$work/$1.log")" test "$status" = "$2"
}

two=(--cameras 2)
begin player1 player "${two[@]}" --camera-id 1 "${camera[@]}" --speed 0.1
says "waiting for a session: that of the player of camera 0" player1
begin frontend1 frontend "${two[@]}" --camera-id 1
begin mapper mapper # of one camera
begin loopcloser loopcloser "${two[@]}"
begin frontend frontend "${two[@]}"
begin player player "${two[@]}" "${camera[@]}" --speed 0.1
says "begins session [0-9]+" player
session=$(sed -nE 's/.*begins session ([0-9]+).*/\1/p' "$work/player.log")
check "it was drawn at random, and is not $session" test "${session:-1}" -gt 1
says "takes session $session" player1 frontend frontend1 mapper loopcloser
few="camera 1 plays in session $session, but this process was told of 1 camera and hears nothing of it: give every process --cameras 2"
says "mapper.*: $few" mapper
sleep 2
check "it is said once" test "$(grep -c "hears nothing of it" "$work/mapper.log")" = 1
check "the loop closer knows of both" test "$(grep -c "hears nothing of it" "$work/loopcloser.log")" = 0
ended player_again 3 player "${two[@]}" "${camera[@]}"
check "a second player finds the session, and who plays it: $(<"$work/player_again.log")" \
  grep -q "session $session: player on .* writes this stream already" "$work/player_again.log"

# A player that comes in the place of another one plays the same recording of the same camera, or nothing.
player1=$(mine | grep -- "dmslam-player.*--camera-id 1" | cut -d: -f1)
kill -TERM "$player1"
while kill -0 "$player1" 2>/dev/null; do sleep 0.05; done
sed -E 's/^( *fx[^:]*: *).*/\1400.0/' "$root/config/synthetic.yaml" >"$work/other.yaml"
ended other_camera 2 player "${two[@]}" --camera-id 1 --sequence "$synthetic" --camera "$work/other.yaml" --speed 0.1
says "session $session is that of synthetic, and its camera has fx 525.*, not fx 400" other_camera
begin player1_again player "${two[@]}" --camera-id 1 "${camera[@]}" --speed 0.1
says "takes session $session" player1_again

# Another system on the same port.
begin other player --session 1 "${camera[@]}" --speed 0.1
sleep 3
guesses="two sessions are on this bus \(1: player on .*; $session: player1? on .*\): choose one with --session"
for id in 0 1; do
  ended "stranger$id" 2 player "${two[@]}" --camera-id "$id" "${camera[@]}"
  says "$guesses" "stranger$id"
done
ended stranger 2 frontend "${two[@]}" --camera-id 1
says "$guesses" stranger
while IFS=: read -r pid _; do kill -TERM "$pid"; done < <(mine)
no_orphans "the run"
finish
