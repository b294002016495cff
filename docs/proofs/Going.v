(* Somebody goes on: from every state that can come about, steps of vehicles and posts lead to one in which a vehicle has
   gone on. So no words that are lost or late leave all vehicles where they are for good. *)
From Coq Require Cantor.
Require Import Posts Books Probes.

Section Going.
Context `{R : roads}.
(* there are finitely many places, and never a lack of new numbers *)
Variable N : nat.
Hypothesis places : forall e, stands e < N /\ wants e < N.
Hypothesis numbers : forall a n, exists f, n <= f /\ src f = a /\ stands f = wants a /\ veh f = veh a.

Inductive steps (s : state) : state -> Prop :=
| nothing : steps s s
| more t u : steps s t -> step t u -> steps s u.

Lemma steps_on s t u : steps s t -> steps t u -> steps s u.
Proof. intros A B. induction B as [|u v B IH St]; auto. eapply more; eauto. Qed.

Lemma reached_on s0 s t : reached s0 s -> steps s t -> reached s0 t.
Proof. intros A B. induction B as [|u v B IH St]; auto. eapply later; eauto. Qed.

(* finitely many numbers are used so far; who was let in has come or has asked *)
Definition few s := (exists m, forall e, m <= e -> asked s e = false /\ granted s e = false /\ used s e = false /\ gone s e = false) /\
  (forall e, granted s e = true -> used s e = true \/ asked s e = true).

Lemma most (l : list nat) : exists m, forall e, In e l -> e < m.
Proof.
  induction l as [|x l [m H]]; [exists 0; intros e []|]. exists (S (max x m)). intros e [<-|J]; [lia|]. specialize (H e J). lia.
Qed.

Lemma few_start s : start s -> few s.
Proof.
  intros (P & E & _). split; [|intros e G; left; destruct (E e) as (_ & -> & _); auto].
  destruct (most (flat_map (book s) (seq 0 N))) as [m H]. exists m. intros e L. destruct (E e) as (G & U & A & Go & _).
  assert (Ng : granted s e = false).
  { apply not_true_iff_false. intro X. apply G in X. specialize (H e). assert (e < m); [|lia]. apply H. apply in_flat_map.
    exists (stands e). split; auto. apply in_seq. destruct (places e). lia. }
  rewrite U, Ng. auto.
Qed.

Lemma few_same s t : few s -> asked t = asked s -> granted t = granted s -> used t = used s -> gone t = gone s -> few t.
Proof. unfold few. intros F -> -> -> ->. auto. Qed.

Lemma few_step s0 s t : sound s -> meant s0 s -> few s -> step s t -> few t.
Proof.
  intros I M [[m Few] Come] St. assert (Same : few s) by (split; eauto).
  assert (Known : forall f, asked s f = true -> f < m).
  { intros f A. destruct (le_lt_dec m f) as [L|]; auto. destruct (Few f L) as (X & _). congruence. }
  assert (In_ : forall f, asked s f = true -> few (admit f s)).
  { intros f A. assert (Lf := Known f A). split; [exists m|].
    - intros e L. destruct (Few e L) as (F1 & F2 & F3 & F4). simpl. unfold upd. destruct (Nat.eq_dec e f); [lia|]. auto.
    - intros e. simpl. unfold upd. destruct (Nat.eq_dec e f) as [->|]; auto. }
  destruct St; try (apply (few_same s); auto; fail).
  - split; [exists (max m (S f))|].
    + intros e L. simpl. unfold upd. destruct (Nat.eq_dec e f); [lia|]. apply Few. lia.
    + intros e G. simpl. unfold upd. destruct (Nat.eq_dec e f); auto.
  - split; [exists m|].
    + intros e L. destruct (Few e L) as (F1 & F2 & F3 & F4). simpl. unfold upd. rewrite F1, F4. simpl.
      assert (Lf := Known f H). assert (src f < m).
      { destruct (le_lt_dec m (src f)) as [L2|]; auto. destruct (i_asked _ I f H) as (_ & _ & U & _). destruct (Few _ L2) as (_ & _ & X & _). congruence. }
      destruct (Nat.eq_dec e (src f)); [lia|]. destruct (Nat.eq_dec e f); [lia|]. auto.
    + intros e G. simpl. unfold upd. destruct (Nat.eq_dec e f); auto.
  - split; [exists m|auto]. intros e L. destruct (Few e L) as (F1 & F2 & F3 & F4). simpl. unfold upd. assert (Lf := Known f H).
    destruct (Nat.eq_dec e f); [lia|]. auto.
  - auto.
  - apply In_. destruct (i_kept _ _ M _ _ H0) as (_ & A & _). auto.
  - auto.
Qed.

Lemma reached_few s0 s : reached s0 s -> few s.
Proof.
  induction 1 as [H|s t R' IH St]; [apply few_start; auto|]. destruct (reached_holds _ _ R') as (_ & I & M). eapply few_step; eauto.
Qed.

(* posts hear what they have not heard, and keep nothing *)
Definition hushed s t := queue t = queue s /\ used t = used s /\ granted t = granted s /\ asked t = asked s /\ gone t = gone s.
Lemma hushed_on s t u : hushed s t -> hushed t u -> hushed s u.
Proof. unfold hushed. intros (A & B & C & D & E) (A' & B' & C' & D' & E'). repeat split; congruence. Qed.

Lemma hear_rears s0 p n : forall s, reached s0 s -> length (rears s p) <= n -> exists t, steps s t /\ hushed s t /\
  book t = book s /\ kept t = kept s /\ rears t p = [] /\ forall r, r <> p -> rears t r = rears s r.
Proof.
  induction n as [|n IH]; intros s Re L; destruct (rears s p) as [|e l] eqn:E; try (simpl in L; lia);
    try (exists s; repeat split; auto; constructor).
  assert (H : In e (rears s p)) by (rewrite E; left; auto). destruct (reached_holds _ _ Re) as (_ & I & _).
  assert (S1 : step s (leave e s)) by (apply leaves; apply (i_rears _ I e p); auto).
  assert (S2 : step (leave e s) (hear_out e p (leave e s))) by (apply hears_out; simpl; auto; unfold upd; destruct (Nat.eq_dec e e); auto).
  destruct (IH (hear_out e p (leave e s))) as (t & St & Hu & B & K & Er & Ot).
  - eapply later; [eapply later|]; eauto.
  - simpl. unfold upd. destruct (Nat.eq_dec p p); [|contradiction]. assert (W := remove_length_lt Nat.eq_dec _ _ H). rewrite E in *. simpl in *. lia.
  - exists t. split; [eapply steps_on; [|exact St]; eapply more; [eapply more; [constructor|]|]; eauto|].
    split; [exact Hu|]. split; [exact B|]. split; [exact K|]. split; auto. intros r Nr. rewrite (Ot r Nr). simpl. unfold upd.
    destruct (Nat.eq_dec r p); [contradiction|auto].
Qed.

Lemma filter_remove (g : nat -> bool) e l : filter g (remove Nat.eq_dec e l) = remove Nat.eq_dec e (filter g l).
Proof.
  induction l as [|x l IH]; simpl; auto. destruct (Nat.eq_dec e x) as [->|Ne].
  - destruct (g x); simpl; auto. destruct (Nat.eq_dec x x); [auto|contradiction].
  - simpl. rewrite IH. destruct (g x); simpl; auto. destruct (Nat.eq_dec e x); [contradiction|auto].
Qed.

Lemma hear_books s0 p n : forall s, reached s0 s -> length (filter (gone s) (book s p)) <= n -> exists t, steps s t /\ hushed s t /\
  kept t p = None /\ (forall e, In e (book t p) -> gone t e = false) /\
  forall r, r <> p -> book t r = book s r /\ rears t r = rears s r /\ kept t r = kept s r.
Proof.
  induction n as [|n IH]; intros s Re L; destruct (filter (gone s) (book s p)) as [|e l] eqn:E; try (simpl in L; lia);
    try (exists (set_kept p None s); split; [eapply more; [constructor|]; constructor|]; split; [repeat split; auto|]; simpl; split;
      [unfold upd; destruct (Nat.eq_dec p p); [auto|contradiction]|]; split;
      [intros e H; apply not_true_iff_false; intro G; assert (X : In e (filter (gone s) (book s p))) by (apply filter_In; auto); rewrite E in X; destruct X
      |intros r Nr; unfold upd; destruct (Nat.eq_dec r p); [contradiction|auto]]).
  assert (H : In e (filter (gone s) (book s p))) by (rewrite E; left; auto). assert (H2 := H). apply filter_In in H2. destruct H2 as [H2 G].
  assert (S1 : step s (hear_gone e p s)) by (apply hears_gone; auto).
  destruct (IH (hear_gone e p s)) as (t & St & Hu & K & Go & Ot).
  - eapply later; eauto.
  - simpl. unfold upd. destruct (Nat.eq_dec p p); [|contradiction]. rewrite filter_remove. assert (W := remove_length_lt Nat.eq_dec _ _ H).
    rewrite E in *. simpl in *. lia.
  - exists t. split; [eapply steps_on; [|exact St]; eapply more; [constructor|]; eauto|]. split; [exact Hu|]. split; auto. split; auto.
    intros r Nr. destruct (Ot r Nr) as (-> & -> & ->). simpl. unfold upd. destruct (Nat.eq_dec r p); [contradiction|auto].
Qed.

Definition tidy s p := kept s p = None /\ rears s p = [] /\ forall e, In e (book s p) -> gone s e = false.

Lemma tidy_up s0 s n : reached s0 s -> exists t, steps s t /\ hushed s t /\ forall p, p < n -> tidy t p.
Proof.
  intro Re. induction n as [|n (t & St & Hu & T)].
  - exists s. split; [constructor|]. split; [repeat split; auto|]. intros; lia.
  - assert (Rt := reached_on _ _ _ Re St).
    destruct (hear_books s0 n _ t Rt (le_n _)) as (u & Su & Hu2 & K & G & Ot). assert (Ru := reached_on _ _ _ Rt Su).
    destruct (hear_rears s0 n _ u Ru (le_n _)) as (v & Sv & Hu3 & B & K3 & Er & Ot3). exists v.
    split; [eapply steps_on; [|exact Sv]; eapply steps_on; eauto|]. split; [eapply hushed_on; [|exact Hu3]; eapply hushed_on; eauto|].
    assert (Gv : gone v = gone u /\ gone u = gone t) by (split; [apply Hu3|apply Hu2]). destruct Gv as [Gv Gu].
    intros p L. unfold tidy. rewrite B, K3, Gv. destruct (Nat.eq_dec p n) as [->|Np]; [auto|].
    destruct (Ot p Np) as (B2 & R2 & K2). rewrite (Ot3 p Np), B2, R2, K2, Gu. apply T. lia.
Qed.

(* with a grant, the vehicle goes *)
Lemma finish s f : asked s f = true -> granted s f = true -> used s f = false -> gone s f = false ->
  hd_error (queue s (stands (src f))) = Some (src f) -> exists t, step s t /\ used t f = true.
Proof.
  intros A G U Go Hd. destruct (queue s (stands (src f))) as [|x rest] eqn:E; [discriminate|]. injection Hd as ->.
  exists (go f rest s). split; [apply goes; auto|]. simpl. unfold upd. destruct (Nat.eq_dec f f); auto.
Qed.

Definition goes_on s := exists t f, steps s t /\ used t f = true /\ used s f = false.

Lemma goes_by s t f : steps s t -> used s f = false -> asked t f = true -> granted t f = true -> used t f = false -> gone t f = false ->
  hd_error (queue t (stands (src f))) = Some (src f) -> goes_on s.
Proof. intros St U A G Ut Go Hd. destruct (finish t f) as (u & Su & X); auto. exists u, f. split; auto. eapply more; eauto. Qed.

Definition alike s t := book t = book s /\ kept t = kept s /\ since t = since s /\ rears t = rears s /\
  asked t = asked s /\ granted t = granted s /\ used t = used s /\ gone t = gone s /\ queue t = queue s.

(* all that are in books stand there; so full places whose heads lead on to one another would be a circle *)
Definition settled_all s := forall p e, In e (book s p) -> used s e = true /\ gone s e = false.

Lemma no_grants s p e g : sound s -> settled_all s -> In e (book s p) -> In g (book s (wants e)) -> asked s g = true -> src g <> e.
Proof.
  intros I A B Bg Ag E. destruct (A _ _ B) as [_ Ge]. destruct (A _ _ Bg) as [Ug Gg].
  destruct (i_asked _ I g Ag) as (_ & _ & _ & [X|[[_ X]|(X & _)]]); congruence.
Qed.

Lemma head_in s p e : head s p = Some e -> In e (book s p). Proof. apply first_in. Qed.

(* the probe goes its way; wherever it ends, somebody goes *)
Lemma walk s0 s f q : sound s -> settled_all s -> (forall p, queue s p = book s p) -> (forall p, p <> q -> kept s p = None) ->
  (forall C, ~ stuck s C) -> kept s q = Some (Pending f) -> stands f = q -> asked s f = true -> granted s f = false -> gone s f = false ->
  hd_error (queue s (stands (src f))) = Some (src f) ->
  forall k V t r z w, alike s t -> reached s0 t -> probe t q (since s q) (stands (src f)) r z w -> head s z = Some w -> wants w = r ->
  NoDup V -> (forall v, In v V -> v < N /\ full s v /\ v <> q /\ exists e, head s v = Some e /\ (In (wants e) V \/ wants e = r)) ->
  N <= length V + k -> goes_on t.
Proof.
  intros I A Q K NC Kq Sf Af Gf Gof Hf. assert (Uf : used s f = false).
  { apply not_true_iff_false. intro X. rewrite (i_used _ I f X) in Gf. discriminate. }
  induction k as [k IH] using lt_wf_ind. intros V t r z w Al Rt P Hz Ww ND HV Big.
  destruct Al as (B & Kt & Si & Re & As & Gr & Us & Go & Qu).
  assert (Rn : r < N) by (subst r; apply places).
  destruct (Nat.eq_dec r q) as [Erq|Nrq].
  { (* it comes back *)
    destruct (reached_few _ _ Rt) as [[m Few] _]. destruct (numbers w m) as (g & Lg & Sg & Wg & Vg).
    destruct (Few g Lg) as (_ & Gg & Ug & Gog). assert (Sw : stands w = z) by (apply (i_place _ I w z); left; apply head_in; auto).
    set (t1 := set_kept q (Some (Offered (veh w) z)) t). set (t2 := ask g t1). set (t3 := admit g t2).
    assert (S1 : step t t1).
    { apply (comes_back t q (stands (src f)) z w f); [|congruence]. rewrite Si. rewrite Erq in P. auto. }
    assert (S2 : step t1 t2).
    { apply asks; auto; try congruence. simpl. rewrite Qu, Sg, Sw, Q. exact Hz. }
    assert (S3 : step t2 t3).
    { apply (takes t2 g (veh w) z); auto; try congruence.
      - simpl. unfold upd. rewrite Wg, Ww, Erq. destruct (Nat.eq_dec q q); [auto|contradiction].
      - simpl. unfold upd. destruct (Nat.eq_dec g g); [auto|contradiction]. }
    apply (goes_by t t3 g); auto.
    - eapply more; [eapply more; [eapply more; [constructor|]|]|]; eauto.
    - simpl. unfold upd. destruct (Nat.eq_dec g g); [auto|contradiction].
    - simpl. unfold upd. destruct (Nat.eq_dec g g); [auto|contradiction].
    - simpl. rewrite Qu, Sg, Sw, Q. exact Hz. }
  assert (D : r = stands (src f) \/ ~ full t r \/ (r <> stands (src f) /\ full t r)).
  { destruct (Nat.eq_dec r (stands (src f))); auto. unfold full. destruct (le_dec (slots r) (length (book t r) + held t r)); auto. }
  assert (D2 : (r = stands (src f) \/ ~ full t r) \/ (r <> stands (src f) /\ full t r)) by tauto. clear D. destruct D2 as [E|[Nra F]].
  { (* it ends *)
    set (t1 := say_clear q (since s q) t). set (t2 := admit f t1).
    assert (S1 : step t t1) by (apply (ends t q _ (stands (src f)) r z w); auto).
    assert (S2 : step t1 t2).
    { apply (clears t1 q f); [|simpl; congruence]. simpl. rewrite Si. auto. }
    apply (goes_by t t2 f); auto; try (simpl; congruence).
    - eapply more; [eapply more; [constructor|]|]; eauto.
    - simpl. unfold upd. destruct (Nat.eq_dec f f); [auto|contradiction]. }
  (* it goes on *)
  assert (Fs : full s r) by (unfold full, held in *; rewrite B, Kt in F; auto).
  assert (Full : forall v, v <> q -> full s v -> length (book s v) = slots v).
  { intros v Nv Fv. assert (L := i_room _ I v). unfold full, held in *. rewrite (K v Nv) in *. lia. }
  destruct (book s r) as [|h l] eqn:Br.
  { assert (L := Full r Nrq Fs). rewrite Br in L. assert (W := wide r). simpl in L. lia. }
  assert (Hr : head s r = Some h) by (unfold head; rewrite Br; auto).
  destruct (in_dec Nat.eq_dec r V) as [Vr|NV].
  { exfalso. apply (NC V). split; [intro X; rewrite X in Vr; destruct Vr|]. intros v Vv.
    destruct (HV v Vv) as (_ & Fv & Nv & e & He & We). split; [apply Full; auto|]. split; [intros x Bx; apply (A v x Bx)|].
    exists e. split; auto. split; [destruct We as [|We]; [auto|rewrite We; auto]|]. intros g Bg Ag.
    apply (no_grants s v e g); auto. apply head_in; auto. }
  set (t1 := say_probe q (since s q) (stands (src f)) (wants h) r h t).
  assert (S1 : step t t1).
  { apply (passes t q _ _ r z w h); auto. unfold head. rewrite B, Br. auto. }
  assert (Lr : length (r :: V) <= N).
  { rewrite <- (seq_length N 0). apply NoDup_incl_length; [constructor; auto|]. intros v [<-|Vv]; apply in_seq; [lia|].
    destruct (HV v Vv). lia. }
  simpl in Lr. assert (G1 : goes_on t1).
  { apply (IH (k - 1)) with (V := r :: V) (r := wants h) (z := r) (w := h); auto; try lia.
    - repeat split; auto.
    - eapply later; eauto.
    - simpl. auto 10.
    - constructor; auto.
    - intros v [<-|Vv]; [split; auto; split; auto; split; auto; exists h; auto|].
      destruct (HV v Vv) as (Ln & Fv & Nv & e & He & We). split; auto. split; auto. split; auto. exists e. split; auto. left.
      destruct We as [We|We]; [right; auto|left; auto].
    - simpl. lia. }
  destruct G1 as (u & g & Su & Ug & Us1). exists u, g. split; [|auto]. eapply steps_on; [|exact Su]. eapply more; [constructor|]; auto.
Qed.

Theorem somebody_goes_on s0 s p : reached s0 s -> queue s p <> [] -> exists t f, steps s t /\ used t f = true /\ used s f = false.
Proof.
  intros Re0 Ne0. change (goes_on s). destruct (tidy_up s0 s N Re0) as (t & St & Hu & Ti).
  cut (goes_on t).
  { intros (u & f & Su & U & V). exists u, f. split; [eapply steps_on; eauto|]. split; auto. destruct Hu as (_ & E & _). congruence. }
  assert (Re := reached_on _ _ _ Re0 St). assert (Ne : queue t p <> []) by (destruct Hu as (-> & _); auto). clear s Re0 Ne0 St Hu. rename t into s.
  destruct (reached_holds _ _ Re) as (_ & I & M). destruct (reached_few _ _ Re) as [[m Few] Come].
  assert (Ti2 : forall r, tidy s r).
  { intro r. destruct (le_lt_dec N r) as [L|]; auto.
    assert (X : forall e, ~ (In e (book s r) \/ In e (rears s r))).
    { intros e H. destruct (i_place _ I e r H) as [E _]. destruct (places e). lia. }
    assert (Er : rears s r = []) by (destruct (rears s r) as [|e l]; auto; exfalso; apply (X e); right; left; auto).
    assert (Eb : book s r = []) by (destruct (book s r) as [|e l]; auto; exfalso; apply (X e); left; left; auto).
    split; [|split; auto; rewrite Eb; intros e []]. destruct (kept s r) eqn:K; auto. destruct (i_last _ I r) as [Z _]; [congruence|].
    assert (W := wide r). rewrite Eb in Z. simpl in Z. lia. }
  clear Ti. rename Ti2 into Ti.
  (* somebody has a grant: it goes *)
  destruct (existsb (fun e => negb (used s e)) (flat_map (book s) (seq 0 N))) eqn:Some_.
  { apply existsb_exists in Some_. destruct Some_ as (f & Hf & Uf). apply negb_true_iff in Uf. apply in_flat_map in Hf. destruct Hf as (r & _ & Bf).
    destruct (Ti r) as (_ & _ & G). specialize (G f Bf). destruct (i_place _ I f r) as [_ Gr]; auto.
    destruct (Come f Gr) as [X|Af]; [congruence|]. destruct (i_asked _ I f Af) as (_ & _ & _ & [X|[[X _]|(_ & _ & Hd)]]); try congruence.
    apply (goes_by s s f); auto. constructor. }
  assert (All : settled_all s).
  { intros r e B. split; [|destruct (Ti r) as (_ & _ & G); auto]. destruct (used s e) eqn:U; auto. exfalso.
    assert (X : existsb (fun e => negb (used s e)) (flat_map (book s) (seq 0 N)) = true); [|congruence].
    apply existsb_exists. exists e. rewrite U. split; auto. apply in_flat_map. exists r. split; auto. apply in_seq.
    destruct (i_place _ I e r) as [E _]; auto. destruct (places e). lia. }
  assert (Q : forall r, queue s r = book s r).
  { intro r. rewrite (i_queue _ I). assert (Z : forall e, In e (book s r) -> used s e && negb (gone s e) = true).
    { intros e B. destruct (All r e B) as [-> ->]. auto. }
    revert Z. generalize (book s r). induction l as [|x l IH]; simpl; intro Z; auto. rewrite Z; auto. f_equal. auto. }
  assert (Kn : forall r, kept s r = None) by (intro r; apply Ti).
  assert (NC : forall C, ~ stuck s C) by (intro C; eapply no_circle; eauto).
  (* some head wants a place with room *)
  set (roomy := fun r => match book s r with e :: _ => length (book s (wants e)) <? slots (wants e) | [] => false end).
  destruct (existsb roomy (seq 0 N)) eqn:Ex.
  2: { exfalso. assert (Fu : forall r e l, book s r = e :: l -> length (book s (wants e)) = slots (wants e)).
    { intros r e l B. assert (L := i_room _ I (wants e)). assert (X : roomy r = false).
      { apply not_true_iff_false. intro X. assert (Y : existsb roomy (seq 0 N) = true); [|congruence]. apply existsb_exists. exists r. split; auto.
        apply in_seq. destruct (i_place _ I e r) as [E _]; [left; rewrite B; left; auto|]. destruct (places e). lia. }
      unfold roomy in X. rewrite B in X. apply Nat.ltb_ge in X. lia. }
    set (C := filter (fun r => slots r <=? length (book s r)) (seq 0 N)).
    assert (InC : forall r, r < N -> length (book s r) = slots r -> In r C).
    { intros r L E. apply filter_In. split; [apply in_seq; lia|apply Nat.leb_le; lia]. }
    apply (NC C). split.
    - rewrite Q in Ne. destruct (book s p) as [|e l] eqn:B; [contradiction|]. intro X.
      assert (Y : In (wants e) C) by (apply InC; [apply places|apply (Fu p e l B)]). rewrite X in Y. destruct Y.
    - intros r Cr. apply filter_In in Cr. destruct Cr as [_ L]. apply Nat.leb_le in L. assert (L2 := i_room _ I r).
      split; [lia|]. split; [intros e B; apply (All r e B)|]. destruct (book s r) as [|e l] eqn:B; [assert (W := wide r); simpl in L; lia|].
      exists e. unfold head. rewrite B. split; auto. split; [apply InC; [apply places|apply (Fu r e l B)]|].
      intros g Bg Ag. apply (no_grants s r e g); auto. rewrite B. left. auto. }
  apply existsb_exists in Ex. destruct Ex as (r & _ & X). unfold roomy in X. destruct (book s r) as [|a l] eqn:Ba; [discriminate|].
  apply Nat.ltb_lt in X. remember (wants a) as q eqn:Eq. assert (Sa : stands a = r) by (apply (i_place _ I a r); left; rewrite Ba; left; auto).
  destruct (numbers a m) as (f & Lf & Sf & Wf & Vf). destruct (Few f Lf) as (_ & Gf & Uf & Gof). rewrite <- Eq in Wf.
  assert (Hd : hd_error (queue s (stands (src f))) = Some (src f)) by (rewrite Sf, Sa, Q, Ba; auto).
  set (s1 := ask f s). assert (S1 : step s s1) by (apply asks; auto; congruence). assert (R1 := later _ _ _ Re S1).
  destruct (reached_holds _ _ R1) as (_ & I1 & M1). assert (A1 : asked s1 f = true) by (simpl; unfold upd; destruct (Nat.eq_dec f f); [auto|contradiction]).
  assert (Se : settled s1 (book s1 (stands f))) by (intros e B; left; apply (All (stands f) e B)).
  assert (Ro : length (book s1 (stands f)) + length (rears s1 (stands f)) < slots (stands f)).
  { simpl. destruct (Ti (stands f)) as (_ & -> & _). rewrite Wf. simpl. lia. }
  destruct (le_lt_dec (slots q) (S (length (book s q)))) as [L|L].
  - destruct (book s q) as [|h l2] eqn:Bq; [assert (W := wide q); simpl in L; lia|].
    set (s2 := keep f h s1). assert (S2 : step s1 s2).
    { apply keeps; auto; [apply (Kn (stands f))| |unfold head]; simpl; rewrite Wf, Bq; auto. simpl in *. lia. }
    assert (R2 := later _ _ _ R1 S2). destruct (reached_holds _ _ R2) as (_ & I2 & M2).
    assert (K2 : kept s2 q = Some (Pending f)) by (simpl; unfold upd; rewrite Wf; destruct (Nat.eq_dec q q); [auto|contradiction]).
    cut (goes_on s2).
    { intros (u & g & Su & Ug & Us). exists u, g. split; [|auto]. eapply steps_on; [|exact Su]. eapply more; [eapply more; [constructor|]|]; eauto. }
    apply (walk s0 s2 f q I2) with (k := N) (V := []) (r := wants h) (z := q) (w := h); auto.
    + intros x Nx. simpl. unfold upd. rewrite Wf. destruct (Nat.eq_dec x q); [contradiction|auto].
    + intro C. eapply no_circle; eauto.
    + repeat split; auto.
    + simpl. right. unfold upd. rewrite Wf. destruct (Nat.eq_dec q q); [auto 10|contradiction].
    + unfold head. simpl. rewrite Bq. auto.
    + constructor.
    + intros v [].
  - set (s2 := admit f s1). assert (S2 : step s1 s2) by (apply enters; auto; simpl; rewrite Wf; auto).
    apply (goes_by s s2 f); auto.
    + eapply more; [eapply more; [constructor|]|]; eauto.
    + simpl. unfold upd. destruct (Nat.eq_dec f f); [auto|contradiction].
Qed.
End Going.

(* The hypotheses can be met: five vehicles go round three places of two, so one slot is free in all. A number tells place,
   vehicle, the stay before, and which try it is. *)
Definition code p v a k := Cantor.to_nat (Cantor.to_nat (p, v), Cantor.to_nat (a, k)).
Definition place_of f := fst (Cantor.of_nat (fst (Cantor.of_nat f))) mod 3.

Lemma elsewhere p : S (p mod 3) mod 3 <> p mod 3.
Proof.
  assert (H : p mod 3 < 3) by (apply Nat.mod_upper_bound; lia). revert H. generalize (p mod 3). intros n H.
  destruct n as [|[|[|n]]]; simpl; lia.
Qed.

#[global] Instance ring : roads := {|
  slots := fun _ => 2; stands := place_of; wants := fun f => S (place_of f) mod 3;
  veh := fun f => snd (Cantor.of_nat (fst (Cantor.of_nat f))); src := fun f => fst (Cantor.of_nat (snd (Cantor.of_nat f)));
  wide := fun _ => le_n 2; no_self := fun e => elsewhere _ |}.

Definition five := [code 0 0 0 0; code 0 1 0 0; code 1 2 0 0; code 1 3 0 0; code 2 4 0 0].
Definition in_ring e := existsb (Nat.eqb e) five.
Definition ring_lines p := filter (fun e => stands e =? p) five.
Definition ring_start := mk ring_lines (fun _ => []) (fun _ => None) (fun _ => 0) (fun _ => false) in_ring in_ring (fun _ => false)
  (fun _ => false) ring_lines (fun _ _ _ _ _ _ => False) (fun _ _ => False) 1.

Lemma ring_starts : start ring_start.
Proof.
  assert (In5 : forall e, in_ring e = true <-> In e five).
  { intro e. unfold in_ring. rewrite existsb_exists. split; [intros (x & I & E); apply Nat.eqb_eq in E; subst; auto|].
    intro I. exists e. split; auto. apply Nat.eqb_refl. }
  assert (ND : NoDup five) by (unfold five; vm_compute; repeat constructor; simpl; lia).
  repeat split; auto.
  - destruct p as [|[|[|p]]]; vm_compute; lia.
  - apply NoDup_filter. auto.
  - intros e H. apply filter_In in H. apply Nat.eqb_eq, H.
  - intro H. apply In5 in H. apply filter_In. split; auto. apply Nat.eqb_refl.
  - intro H. apply In5. apply filter_In in H. apply H.
  - assert (V : Forall (fun e => Forall (fun f => veh e = veh f -> e = f) five) five).
    { unfold five. repeat (apply Forall_cons || apply Forall_nil); vm_compute; intro; auto; discriminate. }
    intros e f He Hf. apply In5 in He, Hf. rewrite Forall_forall in V. specialize (V e He). rewrite Forall_forall in V. auto.
  - intros C [Ne J]. destruct C as [|p C]; [contradiction|].
    assert (N2 : ~ In 2 (p :: C)) by (intro H; destruct (J 2 H) as (L & _); vm_compute in L; discriminate).
    assert (N1 : ~ In 1 (p :: C)).
    { intro H. destruct (J 1 H) as (_ & _ & e & Hd & W & _). vm_compute in Hd. injection Hd as <-. apply N2. exact W. }
    assert (N0 : ~ In 0 (p :: C)).
    { intro H. destruct (J 0 H) as (_ & _ & e & Hd & W & _). vm_compute in Hd. injection Hd as <-. apply N1. exact W. }
    assert (I : In p (p :: C)) by (left; auto). destruct p as [|[|[|p]]]; try contradiction. destruct (J _ I) as (L & _). vm_compute in L. discriminate.
Qed.

Theorem ring_goes_on : exists t f, steps ring_start t /\ used t f = true /\ used ring_start f = false.
Proof.
  apply (somebody_goes_on 3) with (s0 := ring_start) (p := 0).
  - intro e. split; apply Nat.mod_upper_bound; lia.
  - intros a n. exists (code (wants a) (veh a) a n). split; [|split; [|split]].
    + unfold code. assert (A := Cantor.to_nat_non_decreasing a n).
      assert (B := Cantor.to_nat_non_decreasing (Cantor.to_nat (wants a, veh a)) (Cantor.to_nat (a, n))). lia.
    + change (fst (Cantor.of_nat (snd (Cantor.of_nat (code (wants a) (veh a) a n)))) = a). unfold code. rewrite Cantor.cancel_of_to.
      cbn [snd fst]. rewrite Cantor.cancel_of_to. auto.
    + change (place_of (code (wants a) (veh a) a n) = wants a). unfold place_of, code. rewrite Cantor.cancel_of_to.
      cbn [snd fst]. rewrite Cantor.cancel_of_to. apply Nat.mod_small. apply Nat.mod_upper_bound. lia.
    + change (snd (Cantor.of_nat (fst (Cantor.of_nat (code (wants a) (veh a) a n)))) = veh a). unfold code. rewrite Cantor.cancel_of_to.
      cbn [snd fst]. rewrite Cantor.cancel_of_to. auto.
  - apply at_start, ring_starts.
  - vm_compute. discriminate.
Qed.
Print Assumptions somebody_goes_on.
Print Assumptions ring_goes_on.
