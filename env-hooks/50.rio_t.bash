# Completes the options of rio_t's programs, after `rosrun rio_t` and by their names. Sourced by setup.bash.
# It asks the programs themselves: --help lists the options, --print-config the keys of --set.

_rio_t_programs="rio_t_bag rio_t_node calibrate evaluate simulate check_bag report.py draw_rig.py experiment.py"

_rio_t_find() {  # the program's path
  if [[ -x "$1" ]]; then echo "$1"; else catkin_find --first-only --libexec rio_t "$(basename "$1")" 2>/dev/null; fi
}

_rio_t_configs() {
  local folder
  folder=$(catkin_find --first-only --share rio_t config 2>/dev/null) || return
  (cd "$folder" && ls ./*.yaml 2>/dev/null | sed 's|^\./||; s|\.yaml$||')
}

_rio_t_keys() {
  local bag
  bag=$(_rio_t_find rio_t_bag) && "$bag" --print-config 2>/dev/null | sed -n 's/^\([a-z_]*\): .*$/\1=/p'
}

# Fills COMPREPLY for the program $1, the word $2 and the word before it $3.
_rio_t_complete_program() {
  local program word="$2" previous="$3" words=""
  program=$(_rio_t_find "$1")
  [[ "$previous" == "=" ]] && previous="${COMP_WORDS[COMP_CWORD - 2]}"
  case "$previous" in
    --config) words=$(_rio_t_configs) ;;
    --set)
      words=$(_rio_t_keys)
      compopt -o nospace 2>/dev/null
      ;;
  esac
  if [[ "$word" == -* && -n "$program" ]]; then
    words=$("$program" --help 2>/dev/null | grep -oE '(^|[ [])--[a-z][a-z-]*' | grep -oE -- '--[a-z-]+' | sort -u)
  fi
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word"; [[ "$word" == -* || "$previous" == --set ]] || compgen -f -- "$word")
}

_rio_t_complete() {
  _rio_t_complete_program "$1" "$2" "$3"
}

# `rosrun rio_t PROGRAM ...` is ours, anything else that of rosbash.
_rio_t_rosrun() {
  if [[ "${COMP_WORDS[1]}" == rio_t && $COMP_CWORD -ge 3 ]]; then
    _rio_t_complete_program "${COMP_WORDS[2]}" "$2" "$3"
  elif declare -F _roscomplete_exe >/dev/null; then
    _roscomplete_exe "$@"
  fi
}

if type complete >/dev/null 2>&1; then
  # Debian loads the completion of rosrun on demand, and would replace ours with it.
  if ! declare -F _roscomplete_exe >/dev/null && [[ -r /usr/share/bash-completion/completions/rosbash ]]; then
    source /usr/share/bash-completion/completions/rosbash
  fi
  for _rio_t_program in $_rio_t_programs; do
    complete -o filenames -F _rio_t_complete "$_rio_t_program"
  done
  unset _rio_t_program
  complete -o filenames -F _rio_t_rosrun rosrun
fi
