# Somebody without a key insists on taking over, and never comes. Where he stops after two seconds the writers come back and the run
# goes on to its end; where he does so for ever it comes to its end too, or ends and says why. It does not hang.
source "$(dirname "$0")/lib.sh"
port=23530
source "$(dirname "$0")/forging.sh"

beside take-over 100
((status == 0)) || failed "a run with 100 x 'take-over' ended with $status: $(tail -n 3 "$work/$name.said")"
echo "$name: tracked $(field "$work/$name" tracked_percent) %, restarts $(field "$work/$name" restarts)"
expect "who handed over to nobody is started again" "$work/$name" restarts ">= 1"
expect "the sequence is played to its end all the same" "$work/$name" frames "== 70"
expect "no keyframe is missing" "$work/$name" keyframes_missing "== 0"

beside take-over 1000000
case $status in # a short sequence may come to its end between two requests
  0) expect "the sequence is played to its end beside who asks for ever" "$work/$name" frames "== 70" ;;
  4) check "it says why: $(<"$work/$name.said")" grep -q "forger asked for the stream, and nobody has gone on with it" "$work/$name.said" ;;
  *) failed "a run in which somebody asks for ever ended with $status: $(tail -n 3 "$work/$name.said")" ;;
esac
finish
