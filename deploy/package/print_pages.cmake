# Run by cmake --install, with the folder of the built programs in `programs`: writes manual pages and completions to
# the folder `printed`, laid out as under share/.

# print(FILE PROGRAM ARGUMENTS...): what the program prints becomes the file.
function(print file program)
  get_filename_component(folder ${printed}/${file} DIRECTORY)
  file(MAKE_DIRECTORY ${folder})
  execute_process(COMMAND ${programs}/${program} ${ARGN} OUTPUT_FILE ${printed}/${file} RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${programs}/${program} ${ARGN}: ended with ${result}; is it built?")
  endif()
endfunction()

file(REMOVE_RECURSE ${printed})
print(man/man1/lightmill.1 lightmill man)
print(man/man1/lightmill-coordinator.1 lightmill-coordinator --man)
print(man/man1/lightmill-worker.1 lightmill-worker --man)
print(bash-completion/completions/lightmill lightmill completion bash)
print(zsh/vendor-completions/_lightmill lightmill completion zsh)
print(fish/vendor_completions.d/lightmill.fish lightmill completion fish)
