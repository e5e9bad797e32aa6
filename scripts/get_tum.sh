#!/usr/bin/env bash
# Downloads sequences of the TUM RGB-D benchmark by their short names and unpacks them. See --help.
set -euo pipefail

readonly PAGE=https://cvg.cit.tum.de/data/datasets/rgbd-dataset/download
BASE_URL=${DMSLAM_TUM_URL:-https://cvg.cit.tum.de/rgbd/dataset}
TO=${DMSLAM_TUM:-tum}

readonly SEQUENCES="
fr1_xyz fr1_rpy fr2_xyz fr2_rpy
fr1_360 fr1_floor fr1_desk fr1_desk2 fr1_room
fr2_360_hemisphere fr2_360_kidnap fr2_desk fr2_large_no_loop fr2_large_with_loop fr3_long_office_household
fr2_pioneer_360 fr2_pioneer_slam fr2_pioneer_slam2 fr2_pioneer_slam3
fr3_nostructure_notexture_far fr3_nostructure_notexture_near_withloop
fr3_nostructure_texture_far fr3_nostructure_texture_near_withloop
fr3_structure_notexture_far fr3_structure_notexture_near fr3_structure_texture_far fr3_structure_texture_near
fr2_desk_with_person fr3_sitting_static fr3_sitting_xyz fr3_sitting_halfsphere fr3_sitting_rpy
fr3_walking_static fr3_walking_xyz fr3_walking_halfsphere fr3_walking_rpy
fr1_plant fr1_teddy fr2_coke fr2_dishes fr2_flowerbouquet fr2_flowerbouquet_brownbackground
fr2_metallic_sphere fr2_metallic_sphere2 fr3_cabinet fr3_large_cabinet fr3_teddy
"
readonly PAPER="fr3_walking_xyz fr3_walking_rpy fr3_walking_halfsphere fr1_xyz"

usage() {
  cat <<EOF
Usage: get_tum.sh [--to DIR] NAME...
       get_tum.sh --list

Downloads sequences of the TUM RGB-D benchmark (CC BY 4.0) and unpacks them into DIR/rgbd_dataset_freiburg...
NAME is a short name (fr1_xyz, fr3_walking_xyz, ...), the benchmark's own (rgbd_dataset_freiburg1_xyz), or 'paper'
for the four sequences of the DM-SLAM paper. What is there already is left alone; an interrupted download continues.

  --to DIR        where to unpack (default: \$DMSLAM_TUM, else ./tum)
  --list          print the names of the sequences that have a ground truth
  --base-url URL  another mirror (default: \$DMSLAM_TUM_URL, else $BASE_URL); file:// works
  --help          this text

The benchmark's page: $PAGE
EOF
}

say() { printf 'get_tum: %s\n' "$*" >&2; }
die() { say "$*"; exit 1; }

# Short name of any accepted spelling; fails for others.
short_name() {
  local short=${1#rgbd_dataset_}
  short=${short/#freiburg/fr}
  [[ -n $short ]] && grep -qxF -- "$short" <(tr -s ' \n' '\n' <<<"$SEQUENCES") || return 1
  printf '%s\n' "$short"
}

full_name() { printf 'rgbd_dataset_%s\n' "${1/#fr/freiburg}"; }

# fetch URL FILE: continues where an earlier try stopped. Returns 2 where the server cannot be reached.
fetch() {
  local url=$1 file=$2 status=0 begun=0
  [[ -s $file ]] && begun=1  # of an earlier run: it may be whole already, which servers answer with an error
  if [[ $url == file://* ]]; then
    cp -- "${url#file://}" "$file" 2>/dev/null || return 1
  elif command -v curl >/dev/null; then
    local progress=(--silent --show-error)
    [[ -t 2 ]] && progress=(--progress-bar)
    curl --fail --location --retry 2 --connect-timeout 20 --continue-at - "${progress[@]}" -o "$file" "$url" || status=$?
    case $status in
      0) ;;
      5 | 6 | 7 | 18 | 28 | 35 | 56 | 92) return 2 ;;
      23) die "$file cannot be written (is the disk full?); what is there is kept" ;;
      22 | 33) ((begun)) || return 1 ;;
      *) return 1 ;;
    esac
  elif command -v wget >/dev/null; then
    wget --no-verbose --continue --tries=2 --connect-timeout=20 -O "$file" "$url" || status=$?
    case $status in
      0) ;;
      4) return 2 ;;
      3) die "$file cannot be written (is the disk full?); what is there is kept" ;;
      8) ((begun)) || return 1 ;;
      *) return 1 ;;
    esac
  else
    die "neither curl nor wget is here; install one: apt-get install curl"
  fi
}

# check_folder FOLDER: whether an unpacked sequence is whole; says what is missing.
check_folder() {
  local folder=$1 file missing=0 listed=0
  for file in rgb.txt groundtruth.txt; do
    [[ -s $folder/$file ]] || { printf 'it has no %s' "$file"; return 1; }
  done
  while read -r _ file _; do
    [[ -n ${file:-} ]] || continue
    listed=$((listed + 1))
    [[ -s $folder/$file ]] || missing=$((missing + 1))
  done < <(grep -v '^#' "$folder/rgb.txt" | tr -d '\r')
  ((listed > 0)) || { printf 'its rgb.txt lists no image'; return 1; }
  ((missing == 0)) || { printf '%d of the %d images in its rgb.txt are missing' "$missing" "$listed"; return 1; }
}

unpack() {
  local archive=$1 full=$2 reason
  scratch=$(mktemp -d -- "$TO/.unpack.XXXXXX")
  if ! tar -xzf "$archive" -C "$scratch" 2>/dev/null; then
    reason="it does not unpack"
  elif [[ ! -d $scratch/$full ]]; then
    reason="it holds no folder $full"
  else
    reason=$(check_folder "$scratch/$full") || true
  fi
  if [[ -n $reason ]]; then
    rm -rf -- "$scratch" "$archive"
    say "$archive is broken ($reason) and was removed; run the same command again"
    return 1
  fi
  mv -- "$scratch/$full" "$TO/$full"
  rm -rf -- "$scratch" "$archive"
}

get() {
  local short=$1 full archive url status=0 begun=0
  full=$(full_name "$short")
  archive=$TO/$full.tgz
  url=$BASE_URL/freiburg${short:2:1}/$full.tgz
  if [[ -d $TO/$full ]]; then
    local reason
    reason=$(check_folder "$TO/$full") && { say "$TO/$full is there already"; return 0; }
    say "$TO/$full is there, but $reason; remove the folder to get it again"
    return 1
  fi
  say "$short: $url"
  [[ ! -e $archive ]] || begun=1
  fetch "$url" "$archive" || status=$?
  if ((status == 2)); then
    die "no network: ${BASE_URL#*://} cannot be reached. Download $full.tgz with a browser from $PAGE and unpack it into $TO"
  elif ((status != 0)); then
    ((begun)) || rm -f -- "$archive"
    say "$url cannot be downloaded; see $PAGE"
    return 1
  fi
  unpack "$archive" "$full" || return 1
  say "$TO/$full: $(grep -vc '^#' "$TO/$full/rgb.txt") frames"
}

main() {
  local names=() short failed=0
  while (($#)); do
    case $1 in
      --help | -h) usage; exit 0 ;;
      --list) tr -s ' \n' '\n' <<<"$SEQUENCES" | sed '/^$/d' | sort; exit 0 ;;
      --to) [[ -n ${2:-} ]] || die "--to needs a folder"; TO=$2; shift 2 ;;
      --base-url) [[ -n ${2:-} ]] || die "--base-url needs an address"; BASE_URL=${2%/}; shift 2 ;;
      -*) die "unknown option $1; see --help" ;;
      paper) read -ra names <<<"${names[*]-} $PAPER"; shift ;;
      *)
        short=$(short_name "$1") || die "no sequence is called '$1'; see --list"
        names+=("$short")
        shift
        ;;
    esac
  done
  ((${#names[@]})) || { usage >&2; die "name at least one sequence, as fr3_walking_xyz, or 'paper'"; }
  mkdir -p -- "$TO" || die "$TO cannot be made"
  scratch=''
  trap '[[ -z $scratch ]] || rm -rf -- "$scratch"' EXIT
  trap 'say "interrupted; the same command continues"; exit 130' INT TERM
  for short in "${names[@]}"; do
    get "$short" || failed=$((failed + 1))
  done
  ((failed == 0)) || die "$failed of ${#names[@]} sequences are not there"
}

main "$@"
